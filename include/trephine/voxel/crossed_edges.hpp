// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace trephine {

/// Crossings of the isosurface with the voxel edges of a brick, by linear interpolation along the edges. It reads the
/// brick and its halo alone. Positions are in voxels from the brick's voxel 0.
///
/// Rows of bits find the crossed edges. Cost: some nanoseconds for a row of voxels and for a crossing; 64 kB of stack.
template <VoxelDensity Density>
class CrossedEdges {
 public:
  static constexpr int kBrick = VoxelGrid<Density>::kBrick;

  struct Crossing {
    std::array<float, 3> at;
    std::uint32_t edge;  ///< 3 (x + 9 y + 81 z) + axis of its voxel edge, 0 for voxel −1
    std::array<std::int8_t, 3> start;
    std::uint8_t axis;
    bool starts_in_bone;  ///< whether the edge's end of lower index is bone
    [[nodiscard]] Vec3<float> position() const noexcept { return {at[0], at[1], at[2]}; }
  };

  /// Finds the crossings of the brick's own edges, and sums up the crossings of each cell, neighbours' edges included.
  CrossedEdges(const VoxelGrid<Density>& grid, std::size_t brick, double isovalue) noexcept
      : isovalue_(static_cast<float>(isovalue)) {
    const auto [bx, by, bz] = grid.brick_coordinates(brick);
    const std::array<int, 3> base{bx * kBrick, by * kBrick, bz * kBrick};
    for (std::size_t a = 0; a < 3; ++a) {
      lo_[a] = base[a] == 0 ? -1 : 0;
      hi_[a] = std::min(kBrick, grid.size()[a] - base[a]);
    }
    pitch_ = {1, grid.row_pitch(), grid.plane_pitch()};
    origin_ = grid.data() + grid.index(base[0], base[1], base[2]);
    find();
  }

  [[nodiscard]] std::span<const Crossing> crossings() const noexcept { return {crossings_.data(), count_}; }

  /// Returns the mean crossing of a cell beside the edge. db and dc, −1 or 0, select the cell along the two axes that
  /// follow the edge's own.
  [[nodiscard]] Vec3<float> cell_mean(const Crossing& q, int db, int dc) const noexcept {
    const std::size_t b = (q.axis + 1U) % 3, c = (q.axis + 2U) % 3;
    const Cell& cell =
        cells_[static_cast<std::size_t>(static_cast<int>(q.edge / 3) + db * kCellPitch[b] + dc * kCellPitch[c])];
    return Vec3<float>(cell.x, cell.y, cell.z) / cell.count;
  }

  /// Returns the surface's next crossing across the face on one side, −1 or 1, of the edge along axis b. On a face that
  /// is crossed four times it returns the crossing of the opposite edge.
  [[nodiscard]] Vec3<float> next_crossing(const Crossing& q, std::size_t b, int side) const noexcept {
    const std::size_t a = q.axis;
    const Density* const v = at(q.start);
    const auto density = [](const Density* p) { return static_cast<float>(*p); };
    const std::ptrdiff_t aside = side * pitch_[b];
    const float v0 = density(v), v1 = density(v + pitch_[a]);
    const float w0 = density(v + aside), w1 = density(v + pitch_[a] + aside);
    const bool in0 = w0 >= isovalue_, across = in0 != (w1 >= isovalue_), at_end = in0 == q.starts_in_bone;
    const float from = across ? w0 : at_end ? v1 : v0, to = across || at_end ? w1 : w0;
    const float part = (isovalue_ - from) / (to - from);
    std::array<float, 3> p{static_cast<float>(q.start[0]), static_cast<float>(q.start[1]),
                           static_cast<float>(q.start[2])};
    p[a] += across ? part : at_end ? 1.0F : 0.0F;
    p[b] += static_cast<float>(side) * (across ? 1.0F : part);
    return {p[0], p[1], p[2]};
  }

 private:
  static constexpr int kCells = kBrick + 1;  // from −1 on
  static constexpr std::array<int, 3> kCellPitch{1, kCells, kCells* kCells};
  struct Cell {
    float x, y, z, count;
  };

  template <class Index>
  [[nodiscard]] const Density* at(const std::array<Index, 3>& v) const noexcept {
    return origin_ + v[0] + v[1] * pitch_[1] + v[2] * pitch_[2];
  }

  void find() noexcept {
    // Bit i + 1 of row (j, k) is set where voxel i is bone.
    constexpr std::size_t kRow = kBrick + 2;
    std::array<std::uint32_t, kRow * kRow> bone{};
    const auto row_at = [](int j, int k) {
      return static_cast<std::size_t>(k + 1) * kRow + static_cast<std::size_t>(j + 1);
    };
    for (int k = -1; k <= hi_[2]; ++k)
      for (int j = -1; j <= hi_[1]; ++j) {
        const Density* const voxel = at(std::array{0, j, k});
        std::uint32_t bits = 0;
        for (int i = -1; i <= hi_[0]; ++i)
          bits |= static_cast<std::uint32_t>(static_cast<float>(voxel[i]) >= isovalue_) << (i + 1);
        bone[row_at(j, k)] = bits;
      }
    const std::uint32_t starts = (1U << (hi_[0] + 1)) - 1, all = (1U << (hi_[0] + 2)) - 1;
    for (int k = -1; k <= hi_[2]; ++k)
      for (int j = -1; j <= hi_[1]; ++j) {
        const std::uint32_t here = bone[row_at(j, k)];
        const std::array<std::uint32_t, 3> crossed{(here ^ (here >> 1)) & starts,
                                                   j < hi_[1] ? (here ^ bone[row_at(j + 1, k)]) & all : 0,
                                                   k < hi_[2] ? (here ^ bone[row_at(j, k + 1)]) & all : 0};
        for (std::size_t a = 0; a < 3; ++a)
          for (std::uint32_t bits = crossed[a]; bits != 0; bits &= bits - 1) add(std::countr_zero(bits) - 1, j, k, a);
      }
  }

  void add(int i, int j, int k, std::size_t a) noexcept {
    const std::array<int, 3> start{i, j, k};
    const Density* const v = at(start);
    const auto from = static_cast<float>(v[0]), to = static_cast<float>(v[pitch_[a]]);
    std::array<float, 3> p{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
    p[a] += (isovalue_ - from) / (to - from);
    const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
    const int first = (i + 1) * kCellPitch[0] + (j + 1) * kCellPitch[1] + (k + 1) * kCellPitch[2];
    for (int db = -1; db <= 0; ++db)
      for (int dc = -1; dc <= 0; ++dc) {
        const int at_b = start[b] + db, at_c = start[c] + dc;
        if (at_b < -1 || at_c < -1 || at_b >= kBrick || at_c >= kBrick) continue;
        Cell& cell = cells_[static_cast<std::size_t>(first + db * kCellPitch[b] + dc * kCellPitch[c])];
        cell.x += p[0];
        cell.y += p[1];
        cell.z += p[2];
        cell.count += 1;
      }
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (start[axis] < lo_[axis] || start[axis] >= hi_[axis]) return;
    crossings_[count_++] = {p,
                            static_cast<std::uint32_t>(3 * first) + static_cast<std::uint32_t>(a),
                            {static_cast<std::int8_t>(i), static_cast<std::int8_t>(j), static_cast<std::int8_t>(k)},
                            static_cast<std::uint8_t>(a),
                            from >= isovalue_};
  }

  float isovalue_;
  std::array<int, 3> lo_{}, hi_{};  // the brick's own edges start at voxels lo to hi − 1; voxel hi exists
  std::array<std::ptrdiff_t, 3> pitch_{};
  const Density* origin_ = nullptr;
  std::array<Cell, static_cast<std::size_t>(kCells* kCells* kCells)> cells_{};
  std::array<Crossing, static_cast<std::size_t>(3 * kCells * kCells * kCells)> crossings_;
  std::size_t count_ = 0;
};

}  // namespace trephine
