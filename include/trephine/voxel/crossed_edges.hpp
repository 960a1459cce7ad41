// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/bone_rows.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// What surrounds some crossings. Vectors have a component along the edge's own axis a, and along the two axes b and c
/// that follow it. Lengths are in voxels from the brick's voxel 0.
struct CrossingLanes {
  static constexpr std::size_t kLanes = 16;
  using Lanes = std::array<float, kLanes>;
  std::array<Lanes, 3> start;  ///< voxel at the edge's lower end
  std::array<Lanes, 2> ends;   ///< densities at the edge's ends
  Lanes starts_in_bone;        ///< 1 if its lower end is bone, else 0
  /// Sum of the crossings of the cells beside the edge at (b, c) = (−1, −1), (0, −1), (−1, 0), (0, 0), and their
  /// number.
  std::array<std::array<Lanes, 4>, 4> cells;
  /// Densities at the ends of the edges beside at b − 1, b + 1, c − 1, c + 1.
  std::array<std::array<Lanes, 2>, 4> beside;
  std::array<std::uint8_t, kLanes> axis;  ///< a

  /// Sets what depends on densities alone, of lane l: the edge starts at *v, and `pitch` is the distance of voxels
  /// along a, b and c.
  template <class Density>
  void set_densities(std::size_t l, const Density* v, const std::array<std::ptrdiff_t, 3>& pitch,
                     float isovalue) noexcept {
    const std::array<std::ptrdiff_t, 4> aside{-pitch[1], pitch[1], -pitch[2], pitch[2]};
    for (std::size_t end = 0; end < 2; ++end) {
      const Density* const w = end == 0 ? v : v + pitch[0];
      ends[end][l] = static_cast<float>(*w);
      for (std::size_t n = 0; n < 4; ++n) beside[n][end][l] = static_cast<float>(w[aside[n]]);
    }
    starts_in_bone[l] = ends[0][l] >= isovalue ? 1.0F : 0.0F;
  }
};

/// Crossings of the isosurface with the voxel edges of a brick, by linear interpolation along the edges. It reads the
/// brick and its halo alone. Positions are in voxels from the brick's voxel 0.
///
/// Rows of bits find the crossed edges. Cost: some nanoseconds for a row of voxels and for a crossing; 60 kB of stack.
template <VoxelDensity Density>
class CrossedEdges {
 public:
  static constexpr int kBrick = VoxelGrid<Density>::kBrick;

  struct Crossing {
    std::uint32_t edge;  ///< 3 (x + 9 y + 81 z) + axis of its voxel edge, 0 for voxel −1
    std::array<std::int8_t, 3> start;
    std::uint8_t axis;
  };

  /// Finds the crossings of the brick's own edges, and sums up the crossings of each cell, neighbours' edges included.
  CrossedEdges(const VoxelGrid<Density>& grid, std::size_t brick, double isovalue) noexcept
      : rows_(grid, brick, isovalue) {
    rows_.for_each_edge(
        [&]<std::size_t kAxis>(const std::array<int, 3>& start, bool is_own) { add<kAxis>(start, is_own); });
  }

  [[nodiscard]] std::span<const Crossing> crossings() const noexcept { return {crossings_.data(), count_}; }
  [[nodiscard]] float isovalue() const noexcept { return rows_.isovalue(); }

  /// Collects what surrounds `crossings()[first]` and those after it. Lanes beyond the last one repeat it.
  void surround(std::size_t first, CrossingLanes& out) const noexcept {
    for (std::size_t l = 0; l < CrossingLanes::kLanes; ++l) {
      const Crossing& q = crossings_[std::min(first + l, count_ - 1)];
      const std::size_t a = q.axis, b = kNext[a], c = kNext[b];
      out.axis[l] = q.axis;
      out.start[0][l] = q.start[a];
      out.start[1][l] = q.start[b];
      out.start[2][l] = q.start[c];
      const Cell* const cell = &cells_[q.edge / 3];
      for (std::size_t m = 0; m < 4; ++m) {
        const Cell& from = *(cell - (m & 1U ? 0 : kCellPitch[b]) - (m & 2U ? 0 : kCellPitch[c]));
        out.cells[m][0][l] = from[a];
        out.cells[m][1][l] = from[b];
        out.cells[m][2][l] = from[c];
        out.cells[m][3][l] = from[3];
      }
      out.set_densities(l, rows_.at(q.start), {rows_.pitch(a), rows_.pitch(b), rows_.pitch(c)}, isovalue());
    }
  }

 private:
  static constexpr int kCells = kBrick + 1;  // from −1 on
  static constexpr std::array<int, 3> kCellPitch{1, kCells, kCells* kCells};
  static constexpr std::array<std::size_t, 3> kNext{1, 2, 0};
  /// Sum of a cell's crossings, and their number.
  using Cell = std::array<float, 4>;

  template <std::size_t a>
  void add(const std::array<int, 3>& start, bool is_own) noexcept {
    constexpr std::size_t b = kNext[a], c = kNext[b];
    const Density* const v = rows_.at(start);
    const auto from = static_cast<float>(v[0]), to = static_cast<float>(v[rows_.pitch(a)]);
    Cell p{static_cast<float>(start[0]), static_cast<float>(start[1]), static_cast<float>(start[2]), 1};
    p[a] += (isovalue() - from) / (to - from);
    const int first = (start[0] + 1) * kCellPitch[0] + (start[1] + 1) * kCellPitch[1] + (start[2] + 1) * kCellPitch[2];
    for (int db = -1; db <= 0; ++db)
      for (int dc = -1; dc <= 0; ++dc) {
        const int at_b = start[b] + db, at_c = start[c] + dc;
        if (at_b < -1 || at_c < -1 || at_b >= kBrick || at_c >= kBrick) continue;
        Cell& cell = cells_[static_cast<std::size_t>(first + db * kCellPitch[b] + dc * kCellPitch[c])];
        for (std::size_t n = 0; n < 4; ++n) cell[n] += p[n];
      }
    if (is_own)
      crossings_[count_++] = {
          static_cast<std::uint32_t>(3 * first) + static_cast<std::uint32_t>(a),
          {static_cast<std::int8_t>(start[0]), static_cast<std::int8_t>(start[1]), static_cast<std::int8_t>(start[2])},
          static_cast<std::uint8_t>(a)};
  }

  BoneRows<Density> rows_;
  std::array<Cell, static_cast<std::size_t>(kCells* kCells* kCells)> cells_{};
  std::array<Crossing, static_cast<std::size_t>(3 * kCells * kCells * kCells)> crossings_;
  std::size_t count_ = 0;
};

}  // namespace trephine
