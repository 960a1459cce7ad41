// SPDX-License-Identifier: MIT
#include "bone_texture.hpp"

#include <algorithm>
#include <string>

namespace live {
namespace {

void set_parameters(GLint filter, GLint min_filter) {
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, min_filter);
  for (const auto wrap : std::initializer_list<GLenum>{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTexParameteri(GL_TEXTURE_3D, wrap, GL_CLAMP_TO_EDGE);
}

/// Shares of bone now and shares cut, as the texture has them, two bytes a cell.
template <std::size_t N>
std::array<std::uint8_t, 2 * N> now_and_cut(const std::array<std::uint8_t, N>& whole,
                                            const std::array<std::uint8_t, N>& now) {
  std::array<std::uint8_t, 2 * N> out{};
  for (std::size_t i = 0; i < N; ++i) {
    out[2 * i] = now[i];
    out[2 * i + 1] = static_cast<std::uint8_t>(std::max(whole[i] - now[i], 0));
  }
  return out;
}

/// The brick as the bone was loaded.
Haloed original_brick(const drill::Grid& bone, const std::array<int, 3>& at) {
  const std::int16_t* const original = bone.original_data();
  const auto& n = bone.size();
  Haloed out;
  std::size_t to = 0;
  for (int k = 0; k < 10; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 10; ++i)
        out[to++] = original[bone.index(std::min(8 * at[0] + i - 1, n[0]), std::min(8 * at[1] + j - 1, n[1]),
                                        std::min(8 * at[2] + k - 1, n[2]))];
  return out;
}

}  // namespace

BoneTexture::BoneTexture(const drill::Grid& bone, double isovalue) : reader_(bone, false), isovalue_(isovalue) {
  const auto range = bone.original_range();
  densest_ = static_cast<double>(range.max) - isovalue_;
  soft_ = 0.2 * (static_cast<double>(range.max) - static_cast<double>(range.min));
  const auto& n = reader_.size();
  for (std::size_t a = 0; a < 3; ++a) bricks_[a] = (n[a] + 7) / 8;
  GLint largest = 0;
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
  if (*std::max_element(n.begin(), n.end()) > largest)
    throw std::runtime_error("this OpenGL takes volumes of " + std::to_string(largest) +
                             " voxels a side; give a larger --voxel");
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);

  std::vector<std::int16_t> voxels;
  voxels.reserve(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]));
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) voxels.push_back(reader_.voxel(i, j, k));
  gl::to_texture(voxels);
  densities_ = gl::make_texture();
  glBindTexture(GL_TEXTURE_3D, densities_.name());
  set_parameters(GL_LINEAR, GL_LINEAR);
  glTexImage3D(GL_TEXTURE_3D, 0, gl::kShort, n[0], n[1], n[2], 0, GL_RED, gl::kShortType, voxels.data());

  const std::size_t count = reader_.brick_count();
  whole_.resize(count);
  std::vector<BrickShares> now(count);
  std::vector<std::uint8_t> holds_bone(count);
  Haloed haloed;
  for (std::size_t b = 0; b < count; ++b) {
    const Haloed original = original_brick(bone, reader_.brick_coordinates(b));
    const auto [low, high] = std::minmax_element(original.begin(), original.end());
    // What was cut can come back.
    holds_bone[b] = static_cast<double>(*high) >= isovalue_ ? 1 : 0;
    if (static_cast<double>(*high) < isovalue_ - soft_) continue;
    now[b] = whole_[b] = shares_of(original, isovalue_, soft_);
    (void)reader_.copy_brick(b, haloed);
    if (haloed != original) now[b] = shares_of(haloed, isovalue_, soft_);
  }
  empty_ = EmptySpace(bricks_, holds_bone);
  distances_ = gl::make_texture();
  glBindTexture(GL_TEXTURE_3D, distances_.name());
  set_parameters(GL_NEAREST, GL_NEAREST);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_R8UI, bricks_[0], bricks_[1], bricks_[2], 0, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
               empty_.distances().data());

  shares_ = gl::make_texture();
  glBindTexture(GL_TEXTURE_3D, shares_.name());
  set_parameters(GL_LINEAR, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAX_LEVEL, 2);
  // Levels of 4³, 2³ and 1 cell a brick, two bytes each.
  const auto level = [&](GLint number, std::size_t side, const auto& cells_of) {
    const std::array<std::size_t, 3> m{static_cast<std::size_t>(bricks_[0]) * side,
                                       static_cast<std::size_t>(bricks_[1]) * side,
                                       static_cast<std::size_t>(bricks_[2]) * side};
    std::vector<std::uint8_t> cells(2 * m[0] * m[1] * m[2]);
    for (std::size_t b = 0; b < count; ++b) {
      const auto at = reader_.brick_coordinates(b);
      const std::uint8_t *const before = cells_of(whole_[b]), *const own = cells_of(now[b]);
      for (std::size_t c = 0; c < side * side * side; ++c) {
        const std::size_t x = static_cast<std::size_t>(at[0]) * side + c % side,
                          y = static_cast<std::size_t>(at[1]) * side + c / side % side,
                          z = static_cast<std::size_t>(at[2]) * side + c / side / side;
        const std::size_t cell = 2 * ((z * m[1] + y) * m[0] + x);
        cells[cell] = own[c];
        cells[cell + 1] = static_cast<std::uint8_t>(std::max(before[c] - own[c], 0));
      }
    }
    glTexImage3D(GL_TEXTURE_3D, number, GL_RG8, static_cast<GLsizei>(m[0]), static_cast<GLsizei>(m[1]),
                 static_cast<GLsizei>(m[2]), 0, GL_RG, GL_UNSIGNED_BYTE, cells.data());
    bytes_ += cells.size();
  };
  level(0, 4, [](const BrickShares& s) { return s.of_2.data(); });
  level(1, 2, [](const BrickShares& s) { return s.of_4.data(); });
  level(2, 1, [](const BrickShares& s) { return &s.of_8; });
  bytes_ += 2 * voxels.size() + count;
  if (glGetError() != GL_NO_ERROR)
    throw std::runtime_error("OpenGL has no room for the volume (" + std::to_string(bytes_ >> 20) +
                             " MB); give a larger --voxel");
}

void BoneTexture::update(std::size_t brick, const Haloed& haloed) {
  const auto at = reader_.brick_coordinates(brick);
  const auto& n = reader_.size();
  const std::array<GLint, 3> lo{8 * at[0], 8 * at[1], 8 * at[2]};
  const std::array<GLsizei, 3> count{std::min(8, n[0] - lo[0]), std::min(8, n[1] - lo[1]), std::min(8, n[2] - lo[2])};
  Haloed values = haloed;
  gl::to_texture(values);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  // The brick's own voxels lie inside their halo.
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 10);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, 10);
  glBindTexture(GL_TEXTURE_3D, densities_.name());
  glTexSubImage3D(GL_TEXTURE_3D, 0, lo[0], lo[1], lo[2], count[0], count[1], count[2], GL_RED, gl::kShortType,
                  values.data() + 100 + 10 + 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, 0);

  const bool holds_bone = static_cast<double>(*std::max_element(haloed.begin(), haloed.end())) >= isovalue_;
  const std::uint8_t distance = empty_.set(brick, holds_bone);
  glBindTexture(GL_TEXTURE_3D, distances_.name());
  glTexSubImage3D(GL_TEXTURE_3D, 0, at[0], at[1], at[2], 1, 1, 1, GL_RED_INTEGER, GL_UNSIGNED_BYTE, &distance);

  const BrickShares now = shares_of(haloed, isovalue_, soft_);
  const BrickShares& whole = whole_[brick];
  glBindTexture(GL_TEXTURE_3D, shares_.name());
  const auto level = [&](GLint number, int side, const auto& cells) {
    glTexSubImage3D(GL_TEXTURE_3D, number, side * at[0], side * at[1], side * at[2], side, side, side, GL_RG,
                    GL_UNSIGNED_BYTE, cells.data());
  };
  level(0, 4, now_and_cut(whole.of_2, now.of_2));
  level(1, 2, now_and_cut(whole.of_4, now.of_4));
  level(2, 1, now_and_cut<1>({whole.of_8}, {now.of_8}));
}

void BoneTexture::bind() const {
  const std::array<GLuint, 3> names{densities_.name(), distances_.name(), shares_.name()};
  for (GLenum unit = 0; unit < 3; ++unit) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_3D, names[unit]);
  }
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace live
