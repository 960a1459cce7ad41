// SPDX-License-Identifier: MIT
#include "structure_texture.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace live {
namespace {

constexpr GLenum kFirstUnit = 4;
constexpr GLsizei kMaxColours = 256;

void set_parameters(GLenum target, GLint filter) {
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, filter);
  for (const auto wrap : std::initializer_list<GLenum>{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTexParameteri(target, wrap, GL_CLAMP_TO_EDGE);
}

}  // namespace

StructureTexture::StructureTexture(const GuardedBone& guarded, const LeftStructures& left)
    : left_(left), X_GS_(guarded.X_GS), margin_(guarded.margin) {
  const auto& n = left_.size();
  GLint largest = 0;
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
  if (*std::max_element(n.begin(), n.end()) > largest)
    throw std::runtime_error("this OpenGL takes volumes of " + std::to_string(largest) +
                             " voxels a side; the labels have more");
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  distances_ = gl::make_texture();
  glBindTexture(GL_TEXTURE_3D, distances_.name());
  set_parameters(GL_TEXTURE_3D, GL_LINEAR);
  glTexImage3D(GL_TEXTURE_3D, 0, gl::kTwoShorts, n[0], n[1], n[2], 0, GL_RG, gl::kShortType, nullptr);
  update({{0, 0, 0}, {n[0] - 1, n[1] - 1, n[2] - 1}});
  numbers_ = gl::make_texture();
  glBindTexture(GL_TEXTURE_3D, numbers_.name());
  set_parameters(GL_TEXTURE_3D, GL_NEAREST);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_R8UI, n[0], n[1], n[2], 0, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
               left_.numbers().data());

  std::vector<std::uint8_t> colours(static_cast<std::size_t>(3 * kMaxColours));
  for (std::size_t s = 0; s < guarded.structures.size(); ++s)
    for (std::size_t c = 0; c < 3; ++c)
      colours[3 * s + c] = static_cast<std::uint8_t>(255 * guarded.structures[s].colour[c] + 0.5F);
  colours_ = gl::make_texture();
  glBindTexture(GL_TEXTURE_2D, colours_.name());
  set_parameters(GL_TEXTURE_2D, GL_NEAREST);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, kMaxColours, 1, 0, GL_RGB, GL_UNSIGNED_BYTE, colours.data());
  bytes_ = 5 * left_.numbers().size() + colours.size();
  if (glGetError() != GL_NO_ERROR)
    throw std::runtime_error("OpenGL has no room for the structures (" + std::to_string(bytes_ >> 20) + " MB)");
}

void StructureTexture::update(const trephine::VoxelBox& box) {
  if (box.hi[0] < box.lo[0]) return;
  const auto& n = left_.size();
  const int width = box.hi[0] - box.lo[0] + 1, height = box.hi[1] - box.lo[1] + 1;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glBindTexture(GL_TEXTURE_3D, distances_.name());
  std::vector<std::int16_t> slice;
  for (int k = box.lo[2]; k <= box.hi[2]; ++k) {
    slice.clear();
    for (int j = box.lo[1]; j <= box.hi[1]; ++j) {
      const std::size_t first =
          (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j)) *
              static_cast<std::size_t>(n[0]) +
          static_cast<std::size_t>(box.lo[0]);
      for (std::size_t i = first; i < first + static_cast<std::size_t>(width); ++i)
        slice.insert(slice.end(), {left_.samples()[i].left, left_.samples()[i].whole});
    }
    gl::to_texture(slice);
    glTexSubImage3D(GL_TEXTURE_3D, 0, box.lo[0], box.lo[1], k, width, height, 1, GL_RG, gl::kShortType, slice.data());
  }
}

void StructureTexture::bind() const {
  glActiveTexture(GL_TEXTURE0 + kFirstUnit);
  glBindTexture(GL_TEXTURE_3D, distances_.name());
  glActiveTexture(GL_TEXTURE0 + kFirstUnit + 1);
  glBindTexture(GL_TEXTURE_3D, numbers_.name());
  glActiveTexture(GL_TEXTURE0 + kFirstUnit + 2);
  glBindTexture(GL_TEXTURE_2D, colours_.name());
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace live
