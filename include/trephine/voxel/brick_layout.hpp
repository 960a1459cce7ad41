// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace trephine::inline TREPHINE_ALIGNED {

/// Where a grid's voxels lie in its bricks, for tables that hold something for each brick. It copies sizes, not the
/// grid.
class BrickLayout {
 public:
  static constexpr int kBrick = VoxelGrid<float>::kBrick;                                     ///< edge [voxels]
  static constexpr std::size_t kVoxels = static_cast<std::size_t>(kBrick) * kBrick * kBrick;  ///< in a brick

  template <VoxelDensity Density>
  explicit BrickLayout(const VoxelGrid<Density>& grid) noexcept : size_(grid.size()), bricks_(grid.bricks()) {}

  [[nodiscard]] const std::array<int, 3>& size() const noexcept { return size_; }  ///< of the grid [voxels]
  /// Returns the brick of a voxel in the grid.
  [[nodiscard]] std::size_t brick_of(int i, int j, int k) const noexcept {
    return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k / kBrick) * bricks_[1] + j / kBrick) * bricks_[0] +
                                    i / kBrick);
  }
  /// Returns the voxel's number in its brick, x fastest.
  [[nodiscard]] static std::size_t voxel_in_brick(int i, int j, int k) noexcept {
    return static_cast<std::size_t>((k % kBrick * kBrick + j % kBrick) * kBrick + i % kBrick);
  }

  /// Calls `visit(brick, v, first, end)` for each part of voxels (i, j, k) to (i + count − 1, j, k) that lies in one
  /// brick: voxels `first` to `end` − 1 of the row, of which the first is number v in the brick.
  template <class Visit>
  void for_each_part(int i, int j, int k, int count, Visit&& visit) const noexcept {
    for (int first = 0; first < count;) {
      const int x = i + first;
      const int end = std::min(first + kBrick - x % kBrick, count);
      visit(brick_of(x, j, k), voxel_in_brick(x, j, k), first, end);
      first = end;
    }
  }

 private:
  std::array<int, 3> size_, bricks_;
};

}  // namespace trephine
