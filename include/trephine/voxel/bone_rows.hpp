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

namespace trephine::inline TREPHINE_ALIGNED {

/// Which voxels of a brick and its halo are bone, a row of bits each, and the voxel edges between bone and air.
template <VoxelDensity Density>
class BoneRows {
 public:
  static constexpr int kBrick = VoxelGrid<Density>::kBrick;
  static constexpr std::array<std::size_t, 3> kNext{1, 2, 0};

  BoneRows(const VoxelGrid<Density>& grid, std::size_t brick, double isovalue) noexcept
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
    if (!least.is_reached) return;
    const std::uint32_t all = (1U << (hi_[0] + 2)) - 1;
    for (int k = -1; k <= hi_[2]; ++k)
      for (int j = -1; j <= hi_[1]; ++j) {
        // Beyond the last row lies one of border, and 64 spare bytes.
        const Density* const v = at(std::array{-1, j, k});
        bone_[row_at(j, k)] =
            detail::lane_bits<Density, 16>([&](std::size_t l) { return v[l] >= least.density; }) & all;
      }
  }

  [[nodiscard]] float isovalue() const noexcept { return isovalue_; }
  /// Distance of voxels along an axis [elements of the grid's array].
  [[nodiscard]] std::ptrdiff_t pitch(std::size_t axis) const noexcept { return pitch_[axis]; }
  /// Density of a voxel, counted from the brick's voxel 0, and those beside it.
  template <class Index>
  [[nodiscard]] const Density* at(const std::array<Index, 3>& v) const noexcept {
    return origin_ + v[0] + v[1] * pitch_[1] + v[2] * pitch_[2];
  }

  /// Calls `visit.template operator()<axis>(start, is_own)` for each crossed edge of the brick and its halo. Own edges
  /// start at the brick's voxels, or at voxel −1 where that is no other brick's.
  template <class Visit>
  void for_each_edge(Visit&& visit) const noexcept {
    visit_rows(std::array{-1, -1, -1}, hi_, visit);
  }
  /// The same for the brick's own edges alone.
  template <class Visit>
  void for_each_own_edge(Visit&& visit) const noexcept {
    visit_rows(lo_, {hi_[0] - 1, hi_[1] - 1, hi_[2] - 1}, visit);
  }

 private:
  static constexpr std::size_t kRow = kBrick + 2;
  [[nodiscard]] static std::size_t row_at(int j, int k) noexcept {
    return static_cast<std::size_t>(k + 1) * kRow + static_cast<std::size_t>(j + 1);
  }

  template <class Visit>
  void visit_rows(const std::array<int, 3>& first, const std::array<int, 3>& last, Visit& visit) const noexcept {
    // Bit i + 1 is the edge from voxel i on. Edges along x end at voxel hi at most.
    const std::uint32_t some = ((1U << (last[0] + 2)) - 1) & ~((1U << (first[0] + 1)) - 1);
    const std::uint32_t along_x = some & ((1U << (hi_[0] + 1)) - 1);
    for (int k = first[2]; k <= last[2]; ++k)
      for (int j = first[1]; j <= last[1]; ++j) {
        const std::uint32_t here = bone_[row_at(j, k)];
        visit_row<0>((here ^ (here >> 1)) & along_x, j, k, visit);
        if (j < hi_[1]) visit_row<1>((here ^ bone_[row_at(j + 1, k)]) & some, j, k, visit);
        if (k < hi_[2]) visit_row<2>((here ^ bone_[row_at(j, k + 1)]) & some, j, k, visit);
      }
  }
  template <std::size_t kAxis, class Visit>
  void visit_row(std::uint32_t bits, int j, int k, Visit& visit) const noexcept {
    if (bits == 0) return;
    const bool is_own_row = j >= lo_[1] && j < hi_[1] && k >= lo_[2] && k < hi_[2];
    for (; bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits) - 1;
      visit.template operator()<kAxis>(std::array{i, j, k}, is_own_row && i >= lo_[0] && i < hi_[0]);
    }
  }

  float isovalue_;
  std::array<int, 3> lo_{}, hi_{};  // the brick's own edges start at voxels lo to hi − 1; voxel hi exists
  std::array<std::ptrdiff_t, 3> pitch_{};
  const Density* origin_ = nullptr;
  std::array<std::uint32_t, kRow * kRow> bone_{};  // bit i + 1 of row (j, k): whether voxel i is bone
};

}  // namespace trephine
