// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/bone_volume.hpp>
#include <trephine/voxel/lane_bits.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
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
      : isovalue_(detail::LeastBone<float>(isovalue).density) {
    const auto [bx, by, bz] = grid.brick_coordinates(brick);
    const std::array<int, 3> base{bx * kBrick, by * kBrick, bz * kBrick};
    for (std::size_t a = 0; a < 3; ++a) {
      lo_[a] = base[a] == 0 ? -1 : 0;
      hi_[a] = std::min(kBrick, grid.size()[a] - base[a]);
    }
    pitch_ = {1, grid.row_pitch(), grid.plane_pitch()};
    origin_ = grid.data() + grid.index(base[0], base[1], base[2]);
    const detail::LeastBone<Density> least(isovalue);
    if (least.is_reached) find(least.density);
  }

  [[nodiscard]] std::span<const Crossing> crossings() const noexcept { return {crossings_.data(), count_}; }
  [[nodiscard]] float isovalue() const noexcept { return isovalue_; }

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
      const Density* const v = at(q.start);
      const std::array<std::ptrdiff_t, 4> aside{-pitch_[b], pitch_[b], -pitch_[c], pitch_[c]};
      for (std::size_t end = 0; end < 2; ++end) {
        const Density* const w = end == 0 ? v : v + pitch_[a];
        out.ends[end][l] = static_cast<float>(*w);
        for (std::size_t n = 0; n < 4; ++n) out.beside[n][end][l] = static_cast<float>(w[aside[n]]);
      }
    }
    for (std::size_t l = 0; l < CrossingLanes::kLanes; ++l)
      out.starts_in_bone[l] = out.ends[0][l] >= isovalue_ ? 1.0F : 0.0F;
  }

 private:
  static constexpr int kCells = kBrick + 1;  // from −1 on
  static constexpr std::array<int, 3> kCellPitch{1, kCells, kCells* kCells};
  static constexpr std::array<std::size_t, 3> kNext{1, 2, 0};
  /// Sum of a cell's crossings, and their number.
  using Cell = std::array<float, 4>;

  template <class Index>
  [[nodiscard]] const Density* at(const std::array<Index, 3>& v) const noexcept {
    return origin_ + v[0] + v[1] * pitch_[1] + v[2] * pitch_[2];
  }

  void find(Density least) noexcept {
    // Bit i + 1 of row (j, k) is set where voxel i is bone.
    constexpr std::size_t kRow = kBrick + 2;
    std::array<std::uint32_t, kRow * kRow> bone{};
    const auto row_at = [](int j, int k) {
      return static_cast<std::size_t>(k + 1) * kRow + static_cast<std::size_t>(j + 1);
    };
    const std::uint32_t starts = (1U << (hi_[0] + 1)) - 1, all = (1U << (hi_[0] + 2)) - 1;
    for (int k = -1; k <= hi_[2]; ++k)
      for (int j = -1; j <= hi_[1]; ++j) {
        // Beyond the last row lies one of border, and 64 spare bytes.
        std::array<Density, 16> v;
        std::memcpy(v.data(), at(std::array{-1, j, k}), sizeof(v));
        bone[row_at(j, k)] = detail::lane_bits<Density, 16>([&](std::size_t l) { return v[l] >= least; }) & all;
      }
    for (int k = -1; k <= hi_[2]; ++k)
      for (int j = -1; j <= hi_[1]; ++j) {
        const std::uint32_t here = bone[row_at(j, k)];
        add<0>((here ^ (here >> 1)) & starts, j, k);
        if (j < hi_[1]) add<1>(here ^ bone[row_at(j + 1, k)], j, k);
        if (k < hi_[2]) add<2>(here ^ bone[row_at(j, k + 1)], j, k);
      }
  }

  /// Adds crossed edges along axis a that start in a row of voxels, those of bits i + 1.
  template <std::size_t a>
  void add(std::uint32_t bits, int j, int k) noexcept {
    constexpr std::size_t b = kNext[a], c = kNext[b];
    const bool is_own_row = j >= lo_[1] && j < hi_[1] && k >= lo_[2] && k < hi_[2];
    for (; bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits) - 1;
      const std::array<int, 3> start{i, j, k};
      const Density* const v = at(start);
      const auto from = static_cast<float>(v[0]), to = static_cast<float>(v[pitch_[a]]);
      Cell p{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k), 1};
      p[a] += (isovalue_ - from) / (to - from);
      const int first = (i + 1) * kCellPitch[0] + (j + 1) * kCellPitch[1] + (k + 1) * kCellPitch[2];
      for (int db = -1; db <= 0; ++db)
        for (int dc = -1; dc <= 0; ++dc) {
          const int at_b = start[b] + db, at_c = start[c] + dc;
          if (at_b < -1 || at_c < -1 || at_b >= kBrick || at_c >= kBrick) continue;
          Cell& cell = cells_[static_cast<std::size_t>(first + db * kCellPitch[b] + dc * kCellPitch[c])];
          for (std::size_t n = 0; n < 4; ++n) cell[n] += p[n];
        }
      if (!is_own_row || i < lo_[0] || i >= hi_[0]) continue;
      crossings_[count_++] = {static_cast<std::uint32_t>(3 * first) + static_cast<std::uint32_t>(a),
                              {static_cast<std::int8_t>(i), static_cast<std::int8_t>(j), static_cast<std::int8_t>(k)},
                              static_cast<std::uint8_t>(a)};
    }
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
