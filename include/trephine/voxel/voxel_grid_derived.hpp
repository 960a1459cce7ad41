// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/lane_loop.hpp>
#include <trephine/core/relaxed.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>

/// The range of densities that a VoxelGrid derives for each brick. A commit updates it.
namespace trephine::inline TREPHINE_ALIGNED {

/// Returns the box of the brick and its halo, clipped to the grid and its border.
template <class Density>
VoxelBox VoxelGrid<Density>::haloed_box(std::size_t b) const noexcept {
  const auto at_brick = brick_coordinates(b);
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.lo[a] = at_brick[a] * kBrick - 1;
    box.hi[a] = std::min(box.lo[a] + kBrick + 1, size_[a]);
  }
  return box;
}

namespace detail {

/// Minimum and maximum of numbers, accumulated in SIMD lanes. `add` takes n >= kLanes numbers; its last block may
/// overlap the block before it.
template <class T, std::size_t kLanes>
struct LaneRange {
  std::array<T, kLanes> min;
  std::array<T, kLanes> max;
  LaneRange() noexcept {
    min.fill(std::numeric_limits<T>::max());
    max.fill(std::numeric_limits<T>::lowest());
  }
  void add(const T* p, int n) noexcept {
    for (int i = 0;; i = std::min(i + static_cast<int>(kLanes), n - static_cast<int>(kLanes))) {
      std::array<T, kLanes> v;
      std::memcpy(v.data(), p + i, sizeof(v));
      for_lanes<kLanes>([&](std::size_t l) { min[l] = v[l] < min[l] ? v[l] : min[l]; });
      for_lanes<kLanes>([&](std::size_t l) { max[l] = v[l] > max[l] ? v[l] : max[l]; });
      if (i + static_cast<int>(kLanes) >= n) return;
    }
  }
  [[nodiscard]] DensityRange<T> all() const noexcept {
    return {*std::min_element(min.begin(), min.end()), *std::max_element(max.begin(), max.end())};
  }
};

}  // namespace detail

/// Returns the range of the densities in a box. With `stop_at`, the scan ends after the first plane whose maximum
/// reaches that density.
template <class Density>
DensityRange<Density> VoxelGrid<Density>::scan(const VoxelBox& box, const Density* stop_at) const noexcept {
  const int n = box.hi[0] - box.lo[0] + 1;
  const auto over_planes = [&](auto lanes) {
    for (int k = box.lo[2]; k <= box.hi[2]; ++k) {
      for (int j = box.lo[1]; j <= box.hi[1]; ++j) lanes.add(voxels_.data() + index(box.lo[0], j, k), n);
      if (stop_at != nullptr && !(lanes.all().max < *stop_at)) break;
    }
    return lanes.all();
  };
  if (n >= kBrick) return over_planes(detail::LaneRange<Density, kBrick>());
  return over_planes(detail::LaneRange<Density, 1>());
}

template <class Density>
DensityRange<Density> VoxelGrid<Density>::scan_range(std::size_t b) const noexcept {
  return scan(haloed_box(b), nullptr);
}

/// Returns true if a corner voxel of the box has at least this density. It often does, which saves a scan.
template <class Density>
bool VoxelGrid<Density>::corner_reaches(const VoxelBox& box, Density density) const noexcept {
  for (const int k : {box.lo[2], box.hi[2]})
    for (const int j : {box.lo[1], box.hi[1]})
      for (const int i : {box.lo[0], box.hi[0]})
        if (!(at(i, j, k) < density)) return true;
  return false;
}

template <class Density>
void VoxelGrid<Density>::store_range(std::size_t b, const DensityRange<Density>& range) noexcept {
  store_relaxed(ranges_[b].min, range.min);
  store_relaxed(ranges_[b].max, range.max);
}

template <class Density>
void VoxelGrid<Density>::update_range(std::size_t b) noexcept {
  auto& range = ranges_[b];
  if (risen_) return store_range(b, scan_range(b));
  const auto [bx, by, bz] = brick_coordinates(b);
  const std::size_t from = profile_index(brick_row(by, bz), bx * kBrick - 1);
  Density new_min = range.min;
  Density old_max = std::numeric_limits<Density>::lowest();
  for (std::size_t i = from; i < from + kBrick + 2; ++i) {
    new_min = new_min_[i] < new_min ? new_min_[i] : new_min;
    old_max = old_max_[i] > old_max ? old_max_[i] : old_max;
  }
  if (new_min < range.min) store_relaxed(range.min, new_min);
  if (old_max < range.max) return;
  // The edit lowered a voxel at the maximum; the others are at most that.
  const VoxelBox box = haloed_box(b);
  if (!corner_reaches(box, range.max)) store_relaxed(range.max, scan(box, &range.max).max);
}

}  // namespace trephine
