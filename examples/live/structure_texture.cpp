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

StructureTexture::StructureTexture(const GuardedBone& guarded)
    : left_(*guarded.field, guarded.box, guarded.margin), X_GS_(guarded.X_GS), margin_(guarded.margin) {
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
  glTexImage3D(GL_TEXTURE_3D, 0, GL_RG16_SNORM, n[0], n[1], n[2], 0, GL_RG, GL_SHORT, left_.samples().data());
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

bool StructureTexture::update(BurrPath& path, const trephine::Posed& X_SW) {
  trephine::VoxelBox changed = LeftStructures::nothing();
  path.take([&](const BurrPiece& piece) {
    const trephine::VoxelBox box = left_.take({X_SW * piece.from, X_SW * piece.to, piece.radius});
    if (box.hi[0] < box.lo[0]) return;
    LeftStructures::include(changed, box.lo[0], box.lo[1], box.lo[2]);
    LeftStructures::include(changed, box.hi[0], box.hi[1], box.hi[2]);
  });
  upload(changed);
  return changed.hi[0] >= changed.lo[0];
}

void StructureTexture::upload(const trephine::VoxelBox& box) {
  if (box.hi[0] < box.lo[0]) return;
  const auto& n = left_.size();
  const auto side = [&](std::size_t a) { return box.hi[a] - box.lo[a] + 1; };
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, n[0]);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, n[1]);
  const std::size_t first =
      (static_cast<std::size_t>(box.lo[2]) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(box.lo[1])) *
          static_cast<std::size_t>(n[0]) +
      static_cast<std::size_t>(box.lo[0]);
  glBindTexture(GL_TEXTURE_3D, distances_.name());
  glTexSubImage3D(GL_TEXTURE_3D, 0, box.lo[0], box.lo[1], box.lo[2], side(0), side(1), side(2), GL_RG, GL_SHORT,
                  left_.samples().data() + first);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, 0);
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
