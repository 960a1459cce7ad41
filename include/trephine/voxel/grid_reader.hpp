// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/relaxed.hpp>
#include <trephine/voxel/voxel_grid.hpp>

namespace trephine {

/// A view of a grid for any thread but the haptic one (a mesher, a distance map, a saver) while that one carves.
/// It remembers the brick versions it last saw and names the bricks that changed since. Any number of views, each used
/// by one thread; nothing is lost when one stalls; neither side ever waits. The grid must outlive the view and must not
/// be moved meanwhile. Allocates at construction only.
///
/// What is read while the writer is at the same brick may be a mixture of old and new voxels; the version that follows
/// makes the next poll name the brick again, so the last read after the last edit is exact.
template <VoxelDensity Density>
class GridReader {
 public:
  static constexpr int kBrick = VoxelGrid<Density>::kBrick;
  static constexpr int kHaloed = kBrick + 2;

  /// Starts with every brick "changed", so that the first poll visits all of them, or with none.
  explicit GridReader(const VoxelGrid<Density>& grid, bool all_changed = true)
      : grid_(&grid), seen_(grid.brick_count()) {
    for (std::size_t b = 0; b < seen_.size(); ++b) seen_[b] = load_acquire(grid.versions_[b]) - (all_changed ? 1 : 0);
  }

  /// Calls `visit(brick index)` for every brick that changed since its last visit. The version is taken before the
  /// visit reads, so an edit during the visit is seen by the next poll. Returns how many were visited.
  template <class Visit>
  std::size_t poll(Visit&& visit) {
    std::size_t count = 0;
    for (std::size_t b = 0; b < seen_.size(); ++b) {
      const std::uint32_t now = load_acquire(grid_->versions_[b]);
      if (now == seen_[b]) continue;
      seen_[b] = now;
      visit(b);
      ++count;
    }
    return count;
  }

  /// The voxel's density now; i, j, k from −1 (border) to size, not checked.
  [[nodiscard]] Density voxel(int i, int j, int k) const noexcept {
    return load_relaxed(grid_->voxels_[grid_->index(i, j, k)]);
  }

  /// Copies a brick with its one-voxel halo, x fastest, kHaloed³ voxels; beyond the grid's border it is `outside`.
  /// Voxel (0,0,0) of the brick itself is at (1,1,1) of the copy. Returns the exact range of the copy.
  DensityRange<Density> copy_brick(std::size_t b,
                                   std::span<Density, std::size_t{kHaloed} * kHaloed * kHaloed> out) const noexcept {
    const auto [bx, by, bz] = grid_->brick_coordinates(b);
    const auto& n = grid_->size();
    DensityRange<Density> r{std::numeric_limits<Density>::max(), std::numeric_limits<Density>::lowest()};
    auto to = out.begin();
    for (int k = 0; k < kHaloed; ++k)
      for (int j = 0; j < kHaloed; ++j)
        for (int i = 0; i < kHaloed; ++i) {
          const Density v = voxel(std::min(bx * kBrick + i - 1, n[0]), std::min(by * kBrick + j - 1, n[1]),
                                  std::min(bz * kBrick + k - 1, n[2]));
          r.min = std::min(r.min, v);
          r.max = std::max(r.max, v);
          *to++ = v;
        }
    return r;
  }

  /// Range of the brick and its halo as last committed: skip the brick when the isovalue is outside it.
  [[nodiscard]] DensityRange<Density> brick_range(std::size_t b) const noexcept {
    return {load_relaxed(grid_->ranges_[b].min), load_relaxed(grid_->ranges_[b].max)};
  }

  [[nodiscard]] std::size_t brick_count() const noexcept { return seen_.size(); }
  [[nodiscard]] std::array<int, 3> brick_coordinates(std::size_t b) const noexcept {
    return grid_->brick_coordinates(b);
  }
  [[nodiscard]] const std::array<int, 3>& size() const noexcept { return grid_->size(); }
  [[nodiscard]] const Vec3d& spacing() const noexcept { return grid_->spacing(); }

 private:
  const VoxelGrid<Density>* grid_;
  std::vector<std::uint32_t> seen_;
};

}  // namespace trephine
