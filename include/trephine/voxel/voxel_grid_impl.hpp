// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

namespace trephine {

inline constexpr double kShortestSpacing = 1e-9;  // [m]

template <VoxelDensity Density>
VoxelGrid<Density>::VoxelGrid(const GridGeometry& geometry, std::span<const Density> voxels, const GridOptions& options)
    : size_(geometry.size), spacing_(geometry.spacing), X_WG_(geometry.X_WG) {
  std::int64_t count = 1;
  std::int64_t padded = 1;
  for (const int n : size_) {
    if (!(n >= 1)) refuse("VoxelGrid", "each size must be >= 1 voxel", n);
    if (n > (1 << 20)) refuse("VoxelGrid", "each size must be at most 2^20 voxels", n);
    count *= n;
    padded *= n + 4;
    // 32-bit voxel indices keep the sampling kernel in one vector register a lane.
    if (padded > std::numeric_limits<std::int32_t>::max()) refuse("VoxelGrid", "at most 2^31 voxels fit", padded);
  }
  for (int a = 0; a < 3; ++a) {
    if (!(spacing_[a] > 0)) refuse("VoxelGrid", "spacing must be > 0 m", spacing_[a]);
    // Single precision must be able to invert it.
    if (!(spacing_[a] >= kShortestSpacing) || !(spacing_[a] <= kFarthestPosition))
      refuse("VoxelGrid", "spacing must be between 1 nm and 1 km", spacing_[a]);
  }
  check_pose(X_WG_);
  if (static_cast<std::int64_t>(voxels.size()) != count)
    refuse("VoxelGrid", "the buffer must hold " + std::to_string(count) + " voxels", voxels.size());

  original_range_ = {voxels[0], voxels[0]};
  for (const Density v : voxels) {
    if constexpr (std::is_floating_point_v<Density>)
      if (!(std::abs(v) <= 1e30F)) refuse("VoxelGrid", "densities must be finite and below 1e30", v);
    original_range_.min = std::min(original_range_.min, v);
    original_range_.max = std::max(original_range_.max, v);
  }
  const double outside = geometry.outside.value_or(static_cast<double>(original_range_.min));
  if (!(outside >= static_cast<double>(std::numeric_limits<Density>::lowest()) &&
        outside <= static_cast<double>(std::numeric_limits<Density>::max())))
    refuse("VoxelGrid", "outside density must be in the density type's range", outside);
  if constexpr (std::is_floating_point_v<Density>) {
    if (!(std::abs(outside) <= 1e30)) refuse("VoxelGrid", "densities must be finite and below 1e30", outside);
  } else if (outside != std::floor(outside)) {
    refuse("VoxelGrid", "outside density must be whole as the voxels are", outside);
  }
  outside_ = static_cast<Density>(outside);

  lay_out();
  const auto* from = voxels.data();
  for (int k = 0; k < size_[2]; ++k)
    for (int j = 0; j < size_[1]; ++j, from += size_[0])
      std::copy(from, from + size_[0], voxels_.begin() + static_cast<std::ptrdiff_t>(index(0, j, k)));
  if (options.keep_original) {
    original_ = voxels_;
    edited_.assign(versions_.size(), 0);
  }
  for (std::size_t b = 0; b < ranges_.size(); ++b) ranges_[b] = scan_range(b);
  if (options.stored_gradients) {
    differences_.resize(3 * voxels_.size());
    update_differences({{-1, -1, -1}, {size_[0], size_[1], size_[2]}});
  }
}

namespace detail {
inline std::atomic<std::uint64_t> rise_count{0};
}  // namespace detail

template <VoxelDensity Density>
std::uint64_t VoxelGrid<Density>::next_rise_stamp() noexcept {
  return detail::rise_count.fetch_add(1, std::memory_order_relaxed) + 1;
}

template <VoxelDensity Density>
void VoxelGrid<Density>::check_pose(const Posed& X) {
  const Mat3d R = X.linear();
  const double off = (R.transpose() * R - Mat3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kRotationTolerance) || !(R.determinant() > 0))
    refuse("VoxelGrid", "X_WG must hold a right-handed rotation", off);
  if (!(X.translation().norm() <= kFarthestPosition))
    refuse("VoxelGrid", "X_WG must lie within 1 km of the origin", X.translation().norm());
}

template <VoxelDensity Density>
void VoxelGrid<Density>::lay_out() {
  // A pitch of a high power of two maps a column of voxels onto few cache sets: step off it.
  constexpr int kLine = static_cast<int>(64 / sizeof(Density));
  const auto off_power = [](std::int64_t pitch) {
    return static_cast<int>(pitch % (4 * kLine) == 0 ? pitch + 2 : pitch);
  };
  row_ = off_power(size_[0] + 2);
  plane_ = off_power(static_cast<std::int64_t>(row_) * (size_[1] + 2));
  // 64 bytes more: kernels load pairs of voxels at the last address.
  voxels_.assign(static_cast<std::size_t>(plane_) * static_cast<std::size_t>(size_[2] + 2) + kLine, outside_);
  for (std::size_t a = 0; a < 3; ++a) bricks_[a] = (size_[a] + kBrick - 1) / kBrick;
  const auto count = static_cast<std::size_t>(bricks_[0]) * static_cast<std::size_t>(bricks_[1]) *
                     static_cast<std::size_t>(bricks_[2]);
  versions_.assign(count, 0);
  ranges_.assign(count, {outside_, outside_});
  dirt_.assign(count, 0);
  dirty_.reserve(count);
}

template <VoxelDensity Density>
void VoxelGrid<Density>::copy_voxels(std::span<Density> out) const {
  const std::size_t count =
      static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
  if (out.size() != count)
    refuse("VoxelGrid", "copy_voxels needs room for " + std::to_string(count) + " voxels", out.size());
  auto to = out.begin();
  for (int k = 0; k < size_[2]; ++k)
    for (int j = 0; j < size_[1]; ++j) {
      const auto from = voxels_.begin() + static_cast<std::ptrdiff_t>(index(0, j, k));
      to = std::copy(from, from + size_[0], to);
    }
}

template <VoxelDensity Density>
VoxelBox VoxelGrid<Density>::occupied_box(double isovalue) const noexcept {
  VoxelBox box{{size_[0], size_[1], size_[2]}, {-1, -1, -1}};
  for (int k = 0; k < size_[2]; ++k)
    for (int j = 0; j < size_[1]; ++j)
      for (int i = 0; i < size_[0]; ++i)
        if (static_cast<double>(at(i, j, k)) >= isovalue)
          for (std::size_t a = 0; a < 3; ++a) {
            const int v = std::array{i, j, k}[a];
            box.lo[a] = std::min(box.lo[a], v);
            box.hi[a] = std::max(box.hi[a], v);
          }
  return box;
}

template <VoxelDensity Density>
VoxelGrid<Density> VoxelGrid<Density>::cropped(double isovalue, int margin) const {
  if (margin < 0) refuse("VoxelGrid", "crop margin must be >= 0 voxels", margin);
  VoxelBox box = occupied_box(isovalue);
  if (box.empty())
    refuse("VoxelGrid",
           "no voxel reaches the isovalue (densities " + std::to_string(original_range_.min) + " to " +
               std::to_string(original_range_.max) + ")",
           isovalue);
  GridGeometry g{.size = {}, .spacing = spacing_, .X_WG = X_WG_, .outside = static_cast<double>(outside_)};
  for (std::size_t a = 0; a < 3; ++a) {
    box.lo[a] = std::max(box.lo[a] - margin, 0);
    box.hi[a] = std::min(box.hi[a] + margin, size_[a] - 1);
    g.size[a] = box.hi[a] - box.lo[a] + 1;
  }
  const Vec3d p_GC = spacing_.cwiseProduct(Vec3d(box.lo[0], box.lo[1], box.lo[2]));
  g.X_WG.translation() = X_WG_ * p_GC;
  std::vector<Density> voxels;
  voxels.reserve(static_cast<std::size_t>(g.size[0]) * static_cast<std::size_t>(g.size[1]) *
                 static_cast<std::size_t>(g.size[2]));
  for (int k = box.lo[2]; k <= box.hi[2]; ++k)
    for (int j = box.lo[1]; j <= box.hi[1]; ++j) {
      const auto from = voxels_.begin() + static_cast<std::ptrdiff_t>(index(box.lo[0], j, k));
      voxels.insert(voxels.end(), from, from + g.size[0]);
    }
  return VoxelGrid(g, voxels, {.keep_original = !original_.empty(), .stored_gradients = has_stored_gradients()});
}

template <VoxelDensity Density>
template <class DensityOf>
int VoxelGrid<Density>::lower_row(int j, int k, int x0, int x1, DensityOf&& density_of) noexcept {
  return lower_lanes(j, k, x0, x1, [&](int x, int count, const Lanes& old, Lanes& value) {
    for (int l = 0; l < count; ++l) {
      const auto lane = static_cast<std::size_t>(l);
      value[lane] = density_of(x + l, old[lane]);
    }
  });
}

template <VoxelDensity Density>
template <class Edit>
int VoxelGrid<Density>::lower_lanes(int j, int k, int x0, int x1, Edit&& edit) noexcept {
  // What a block reads past x1 is there: a row of border follows, and after the last one 64 spare bytes.
  constexpr int kSpare = static_cast<int>(64 / sizeof(Density));
  static_assert(kLowerLanes <= kSpare);
  Density* row = voxels_.data() + index(0, j, k);
  int first = x1 + 1;
  int last = x0 - 1;
  int changed = 0;
  // Of whole blocks: bounds of the changed voxels' densities, which is what `mark` needs.
  Density new_min = std::numeric_limits<Density>::max();
  Density old_max = std::numeric_limits<Density>::lowest();
  for (int x = x0; x <= x1; x += kLowerLanes) {
    Lanes old;
    std::memcpy(old.data(), row + x, sizeof(old));
    Lanes value = old;
    const int count = std::min(x1 - x + 1, kLowerLanes);
    edit(x, count, std::as_const(old), value);
    if (std::memcmp(value.data(), old.data(), sizeof(old)) == 0) continue;
    // In separate loops over all lanes, so that they vectorise.
    for (std::size_t l = 0; l < kLowerLanes; ++l) value[l] = value[l] < old[l] ? value[l] : old[l];
    for (std::size_t l = static_cast<std::size_t>(count); l < kLowerLanes; ++l) value[l] = old[l];
    for (std::size_t l = 0; l < kLowerLanes; ++l) new_min = value[l] < new_min ? value[l] : new_min;
    for (std::size_t l = 0; l < kLowerLanes; ++l) old_max = old[l] > old_max ? old[l] : old_max;
    int in_block = 0;
    for (std::size_t l = 0; l < kLowerLanes; ++l) in_block += value[l] < old[l] ? 1 : 0;
    if (in_block == 0) continue;
    changed += in_block;
    int i0 = 0;
    int i1 = count - 1;
    while (!(value[static_cast<std::size_t>(i0)] < old[static_cast<std::size_t>(i0)])) ++i0;
    while (!(value[static_cast<std::size_t>(i1)] < old[static_cast<std::size_t>(i1)])) --i1;
    for (int i = i0; i <= i1; ++i) store_relaxed(row[x + i], value[static_cast<std::size_t>(i)]);
    first = std::min(first, x + i0);
    last = x + i1;
  }
  if (changed != 0) mark(j, k, first, last, new_min, old_max);
  return changed;
}

template <VoxelDensity Density>
void VoxelGrid<Density>::touch(std::size_t b, std::uint8_t flags) noexcept {
  if (dirt_[b] == 0) dirty_.push_back(static_cast<int>(b));
  dirt_[b] = static_cast<std::uint8_t>(dirt_[b] | kTouched | flags);
}

template <VoxelDensity Density>
void VoxelGrid<Density>::grow_edit_box(const std::array<int, 3>& lo, const std::array<int, 3>& hi) noexcept {
  const bool first = edit_box_.empty();
  for (std::size_t a = 0; a < 3; ++a) {
    edit_box_.lo[a] = first ? lo[a] : std::min(edit_box_.lo[a], lo[a]);
    edit_box_.hi[a] = first ? hi[a] : std::max(edit_box_.hi[a], hi[a]);
  }
}

template <VoxelDensity Density>
void VoxelGrid<Density>::mark(int j, int k, int x0, int x1, Density new_min, Density old_max) noexcept {
  grow_edit_box({x0, j, k}, {x1, j, k});
  const auto from = [](int lo) { return std::max(lo - 1, 0) / kBrick; };
  const auto to = [](int hi, int bricks) { return std::min((hi + 1) / kBrick, bricks - 1); };
  for (int bz = from(k); bz <= to(k, bricks_[2]); ++bz)
    for (int by = from(j); by <= to(j, bricks_[1]); ++by)
      for (int bx = from(x0); bx <= to(x1, bricks_[0]); ++bx) {
        const std::size_t b = brick_index(bx, by, bz);
        auto& range = ranges_[b];
        touch(b, old_max < range.max ? std::uint8_t{0} : kMaxStale);
        if (!(new_min < range.min)) continue;
        // The row's minimum may lie in another brick: take that of the part this brick and its halo hold.
        const Density* row = voxels_.data() + index(0, j, k);
        const int end = std::min(x1, bx * kBrick + kBrick);
        Density low = range.min;
        for (int i = std::max(x0, bx * kBrick - 1); i <= end; ++i) low = std::min(low, row[i]);
        store_relaxed(range.min, low);
      }
  if (edited_.empty()) return;
  for (int bx = x0 / kBrick; bx <= x1 / kBrick; ++bx) edited_[brick_index(bx, j / kBrick, k / kBrick)] = 1;
}

template <VoxelDensity Density>
void VoxelGrid<Density>::commit() noexcept {
  for (const int dirty : dirty_) {
    const auto b = static_cast<std::size_t>(dirty);
    auto& range = ranges_[b];
    if ((dirt_[b] & kBothStale) != 0) {
      const auto scanned = scan_range(b);
      store_relaxed(range.min, scanned.min);
      store_relaxed(range.max, scanned.max);
    } else if ((dirt_[b] & kMaxStale) != 0) {
      store_relaxed(range.max, scan_max(b, range.max));
    }
    if (has_stored_gradients()) update_differences(b);
    store_release(versions_[b], versions_[b] + 1);
    dirt_[b] = 0;
  }
  if (!dirty_.empty()) {
    last_edit_ = edit_box_;
    ++edit_count_;
  }
  dirty_.clear();
  edit_box_ = {};
}

/// The brick and its halo, as far as they lie in the grid and its border.
template <VoxelDensity Density>
VoxelBox VoxelGrid<Density>::haloed_box(std::size_t b) const noexcept {
  const auto at_brick = brick_coordinates(b);
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.lo[a] = at_brick[a] * kBrick - 1;
    box.hi[a] = std::min(box.lo[a] + kBrick + 1, size_[a]);
  }
  return box;
}

template <VoxelDensity Density>
DensityRange<Density> VoxelGrid<Density>::scan_range(std::size_t b) const noexcept {
  const VoxelBox box = haloed_box(b);
  DensityRange<Density> r{std::numeric_limits<Density>::max(), std::numeric_limits<Density>::lowest()};
  for (int k = box.lo[2]; k <= box.hi[2]; ++k)
    for (int j = box.lo[1]; j <= box.hi[1]; ++j) {
      const Density* row = voxels_.data() + index(0, j, k);
      for (int i = box.lo[0]; i <= box.hi[0]; ++i) {
        r.min = std::min(r.min, row[i]);
        r.max = std::max(r.max, row[i]);
      }
    }
  return r;
}

/// Largest density of the brick and its halo, known to be at most `at_most`: done at the first row that reaches it.
template <VoxelDensity Density>
Density VoxelGrid<Density>::scan_max(std::size_t b, Density at_most) const noexcept {
  const VoxelBox box = haloed_box(b);
  Density max = std::numeric_limits<Density>::lowest();
  for (int k = box.lo[2]; k <= box.hi[2]; ++k)
    for (int j = box.lo[1]; j <= box.hi[1]; ++j) {
      const Density* row = voxels_.data() + index(0, j, k);
      for (int i = box.lo[0]; i <= box.hi[0]; ++i) max = std::max(max, row[i]);
      if (!(max < at_most)) return max;
    }
  return max;
}

/// Differences change in the edited voxels and their neighbours, and all of those lie in marked bricks (or in the
/// border beside them): brick by brick the work stays bounded when the edits lie far apart.
template <VoxelDensity Density>
void VoxelGrid<Density>::update_differences(std::size_t b) noexcept {
  const auto at_brick = brick_coordinates(b);
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const int lo = at_brick[a] == 0 ? -1 : at_brick[a] * kBrick;
    const int hi = at_brick[a] == bricks_[a] - 1 ? size_[a] : at_brick[a] * kBrick + kBrick - 1;
    box.lo[a] = std::max(lo, edit_box_.lo[a] - 1);
    box.hi[a] = std::min(hi, edit_box_.hi[a] + 1);
  }
  update_differences(box);
}

template <VoxelDensity Density>
void VoxelGrid<Density>::update_differences(const VoxelBox& box) noexcept {
  // At the border the array ends: one-sided there, twice as short.
  const auto difference = [this](std::size_t centre, int i, int last, std::ptrdiff_t step) {
    const Density* v = voxels_.data() + centre;
    return static_cast<Difference>(static_cast<Difference>(i < last ? v[step] : *v) -
                                   static_cast<Difference>(i > -1 ? v[-step] : *v));
  };
  for (int k = box.lo[2]; k <= box.hi[2]; ++k)
    for (int j = box.lo[1]; j <= box.hi[1]; ++j)
      for (int i = box.lo[0]; i <= box.hi[0]; ++i) {
        const std::size_t at_voxel = index(i, j, k);
        Difference* d = differences_.data() + 3 * at_voxel;
        d[0] = difference(at_voxel, i, size_[0], 1);
        d[1] = difference(at_voxel, j, size_[1], row_);
        d[2] = difference(at_voxel, k, size_[2], plane_);
      }
}

template <VoxelDensity Density>
void VoxelGrid<Density>::restore_brick(std::size_t b) noexcept {
  const auto [bx, by, bz] = brick_coordinates(b);
  const std::array lo{bx * kBrick, by * kBrick, bz * kBrick};
  const std::array hi{std::min(lo[0] + kBrick, size_[0]) - 1, std::min(lo[1] + kBrick, size_[1]) - 1,
                      std::min(lo[2] + kBrick, size_[2]) - 1};
  for (int k = lo[2]; k <= hi[2]; ++k)
    for (int j = lo[1]; j <= hi[1]; ++j) {
      const std::size_t at_row = index(lo[0], j, k);
      for (int i = 0; i <= hi[0] - lo[0]; ++i)
        store_relaxed(voxels_[at_row + static_cast<std::size_t>(i)], original_[at_row + static_cast<std::size_t>(i)]);
    }
  grow_edit_box(lo, hi);
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const int x = bx + dx;
        const int y = by + dy;
        const int z = bz + dz;
        if (x < 0 || y < 0 || z < 0 || x >= bricks_[0] || y >= bricks_[1] || z >= bricks_[2]) continue;
        touch(brick_index(x, y, z), kBothStale);
      }
  edited_[b] = 0;
  rise_stamp_ = next_rise_stamp();
}

template <VoxelDensity Density>
std::size_t VoxelGrid<Density>::restore(std::size_t max_bricks) {
  if (original_.empty()) refuse("VoxelGrid", "restore() needs GridOptions::keep_original", "none");
  std::size_t left = 0;
  for (std::size_t b = 0; b < edited_.size(); ++b) {
    if (edited_[b] == 0) continue;
    if (max_bricks > 0) {
      restore_brick(b);
      --max_bricks;
    } else {
      ++left;
    }
  }
  commit();
  return left;
}

}  // namespace trephine
