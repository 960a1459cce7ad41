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
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Computes the volume of bone that a cut removes, from the cells with a changed corner. It keeps two planes of voxels,
/// each a tile of up to `kRows` rows of `kVoxels` voxels, with a bit a voxel. So a row of cells is compared in a few
/// operations.
template <VoxelDensity Density>
class LostCells {
 public:
  static constexpr int kRows = 16;
  static constexpr int kVoxels = 62;  // and one more at either end

  LostCells(const VoxelGrid<Density>& grid, double isovalue) noexcept
      : grid_(grid), least_(isovalue), before_(isovalue), after_(isovalue) {}

  /// Begins a tile of rows j to j + kRows − 1 and voxels x to x + kVoxels − 1, without the border.
  void start(int x, int j) noexcept {
    x_ = x - 1;
    j_ = j - 1;
    here_->changed_rows = 0;
  }

  /// Continues with plane k, the one after the last. Its voxels `from` to `to` may have changed cells.
  void enter(int k, int from, int to) noexcept {
    std::swap(here_, last_);
    here_->k = k;
    here_->from = std::clamp(from - 1 - x_, 0, kVoxels + 1);
    here_->to = std::clamp(to + 1 - x_, 0, kVoxels + 1);
    here_->loaded_rows = 0;
    here_->changed_rows = 0;
  }

  /// Records the lanes (`changed`) of row j, from voxel x on, that are about to get these values.
  template <std::size_t kLanes>
  void note(int j, int x, std::uint32_t changed, const std::array<Density, kLanes>& value) noexcept {
    if (!least_.is_reached) return;
    const int row = j - j_;
    const auto r = static_cast<std::size_t>(row);
    load(*here_, row);
    const Density least = least_.density;
    const std::uint32_t air = changed & lane_bits<Density, kLanes>([&](std::size_t l) { return value[l] < least; });
    const auto place = [at = x - x_](std::uint64_t bits) { return at < 0 ? bits >> -at : bits << at; };
    here_->changed[r] |= place(changed);
    here_->bone_after[r] &= ~place(air);
    here_->changed_rows |= 1U << row;
  }

  /// Adds the changed cells between the last plane and this one.
  void add() noexcept {
    const std::uint32_t changed = last_->changed_rows | here_->changed_rows;
    for (std::uint32_t rows = changed | changed >> 1; rows != 0; rows &= rows - 1) add_row(std::countr_zero(rows));
  }

  /// Returns the volume lost so far [cells].
  [[nodiscard]] double cells() noexcept { return static_cast<double>(whole_) + before_.sum() - after_.sum(); }

 private:
  using Row = std::array<Density, kVoxels + 2 + VoxelGrid<Density>::kLowerLanes>;
  struct Plane {
    int k = 0;
    int from = 0, to = 0;  // voxels that are compared
    std::uint32_t loaded_rows = 0, changed_rows = 0;
    std::array<std::uint64_t, kRows + 2> changed, bone, bone_after;
    std::array<Row, kRows + 2> old;
  };

  /// Copies a row's densities before the first change, or in a row without changes.
  void load(Plane& plane, int row) noexcept {
    if ((plane.loaded_rows >> row & 1U) != 0) return;
    plane.loaded_rows |= 1U << row;
    const auto r = static_cast<std::size_t>(row);
    constexpr std::size_t kLanes = VoxelGrid<Density>::kLowerLanes;
    const Density* const from = voxels(plane, row);
    const Density least = least_.density;
    std::uint64_t bone = 0;
    for (int i = plane.from; i <= plane.to; i += static_cast<int>(kLanes)) {
      // Compared in place: compilers do not vectorise the comparison of a copy.
      const Density* const v = from + i;
      std::memcpy(plane.old[r].data() + i, v, kLanes * sizeof(Density));
      bone |= std::uint64_t{lane_bits<Density, kLanes>([&](std::size_t l) { return v[l] >= least; })} << i;
    }
    plane.changed[r] = 0;
    plane.bone[r] = plane.bone_after[r] = bone;
  }

  [[nodiscard]] const Density* voxels(const Plane& plane, int row) const noexcept {
    return grid_.data() + grid_.index(x_, j_ + row, plane.k);
  }

  void add_row(int row) noexcept {
    load(*last_, row);
    load(*last_, row + 1);
    load(*here_, row);
    load(*here_, row + 1);
    const auto r = static_cast<std::size_t>(row);
    const auto any = [&](const auto& a, const auto& b) { return a[r] | a[r + 1] | b[r] | b[r + 1]; };
    const auto all = [&](const auto& a, const auto& b) { return a[r] & a[r + 1] & b[r] & b[r + 1]; };
    // Bit i belongs to the cell between voxels i and i + 1.
    const auto either = [](std::uint64_t v) { return v | v >> 1; };
    const auto both = [](std::uint64_t v) { return v & v >> 1; };
    const std::uint64_t changed = either(any(last_->changed, here_->changed));
    const std::uint64_t some = changed & either(any(last_->bone, here_->bone));
    if (some == 0) return;
    const std::uint64_t whole = changed & both(all(last_->bone, here_->bone));
    const std::uint64_t some_after = changed & either(any(last_->bone_after, here_->bone_after));
    const std::uint64_t whole_after = changed & both(all(last_->bone_after, here_->bone_after));
    // Densities only fall: a cell that is whole after the cut was whole before.
    whole_ += std::popcount(whole ^ whole_after);
    before_.add(some & ~whole, last_->old[r].data(), last_->old[r + 1].data(), here_->old[r].data(),
                here_->old[r + 1].data());
    after_.add(some_after & ~whole_after, voxels(*last_, row), voxels(*last_, row + 1), voxels(*here_, row),
               voxels(*here_, row + 1));
  }

  const VoxelGrid<Density>& grid_;
  LeastBone<Density> least_;
  CrossedCells<Density> before_, after_;
  std::int64_t whole_ = 0;
  int x_ = 0, j_ = 0;  // voxel of bit 0, row of row 0
  std::array<Plane, 2> planes_;
  Plane* here_ = &planes_[0];
  Plane* last_ = &planes_[1];
};

}  // namespace trephine::detail
