// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/relaxed.hpp>
#include <trephine/voxel/voxel_grid.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A lock-free view of a grid for other threads (a mesher, a distance map, a saver) while the haptic thread carves.
/// It stores the version of each brick at its last visit and reports the bricks that changed since. Any number of views
/// may exist, each used by one thread. A stalled view loses no edit, and neither side ever waits. The grid must outlive
/// the view and must not be moved meanwhile. Allocates at construction only.
///
/// A read that overlaps an edit of the same brick may mix old and new voxels. The edit then raises the brick's version,
/// and the next poll reports it again. So the last read after the last edit is exact.
template <VoxelDensity Density>
class GridReader {
 public:
  static constexpr int kBrick = VoxelGrid<Density>::kBrick;
  static constexpr int kHaloed = kBrick + 2;

  /// With `all_changed` every brick counts as changed, so the first poll visits all; otherwise none.
  explicit GridReader(const VoxelGrid<Density>& grid, bool all_changed = true)
      : grid_(&grid), visited_versions_(grid.brick_count()) {
    for (std::size_t b = 0; b < visited_versions_.size(); ++b)
      visited_versions_[b] = load_acquire(grid.versions_[b]) - (all_changed ? 1 : 0);
  }

  /// Calls `visit(brick index)` for every brick that changed since its last visit; returns their number. The version is
  /// loaded before the visit reads, so the next poll reports an edit during the visit.
  template <class Visit>
  std::size_t poll(Visit&& visit) {
    std::size_t count = 0;
    for (std::size_t b = 0; b < visited_versions_.size(); ++b) {
      const std::uint32_t now = load_acquire(grid_->versions_[b]);
      if (now == visited_versions_[b]) continue;
      visited_versions_[b] = now;
      visit(b);
      ++count;
    }
    return count;
  }

  /// Returns the voxel's present density; i, j, k from −1 (border) to size (border), not checked.
  [[nodiscard]] Density voxel(int i, int j, int k) const noexcept {
    return load_relaxed(grid_->voxels_[grid_->index(i, j, k)]);
  }

  /// Copies a brick with its one-voxel halo, x fastest, kHaloed³ voxels; voxels beyond the grid have the outside
  /// density. The brick's own voxel (0, 0, 0) is at (1, 1, 1) of the copy. Returns the exact density range of the copy.
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

  /// Returns the density range of the brick and its halo at the last commit. A brick has no surface if the isovalue is
  /// outside this range.
  [[nodiscard]] DensityRange<Density> brick_range(std::size_t b) const noexcept {
    return {load_relaxed(grid_->ranges_[b].min), load_relaxed(grid_->ranges_[b].max)};
  }

  [[nodiscard]] std::size_t brick_count() const noexcept { return visited_versions_.size(); }
  [[nodiscard]] std::array<int, 3> brick_coordinates(std::size_t b) const noexcept {
    return grid_->brick_coordinates(b);
  }
  [[nodiscard]] const std::array<int, 3>& size() const noexcept { return grid_->size(); }
  [[nodiscard]] const Vec3d& spacing() const noexcept { return grid_->spacing(); }

 private:
  const VoxelGrid<Density>* grid_;
  std::vector<std::uint32_t> visited_versions_;
};

}  // namespace trephine
