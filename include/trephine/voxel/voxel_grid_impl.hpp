// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

// Decides which input is refused.
inline constexpr double kMaxDensityMagnitude = 1e30;  // differences of densities stay finite in single precision

template <class Density>
VoxelGrid<Density>::VoxelGrid(const GridGeometry& geometry, std::span<const Density> voxels, const GridOptions& options)
    : size_(geometry.size), spacing_(geometry.spacing), X_WG_(geometry.X_WG) {
  detail::check_grid("VoxelGrid", "X_WG", geometry, voxels.size());

  original_range_ = {voxels[0], voxels[0]};
  for (const Density v : voxels) {
    if constexpr (std::is_floating_point_v<Density>)
      if (!(std::abs(v) <= static_cast<float>(kMaxDensityMagnitude)))
        refuse("VoxelGrid", "densities must be finite and below 1e30", v);
    original_range_.min = std::min(original_range_.min, v);
    original_range_.max = std::max(original_range_.max, v);
  }
  const double outside = geometry.outside.value_or(static_cast<double>(original_range_.min));
  if (!(outside >= static_cast<double>(std::numeric_limits<Density>::lowest()) &&
        outside <= static_cast<double>(std::numeric_limits<Density>::max())))
    refuse("VoxelGrid", "outside density must be in the density type's range", outside);
  if constexpr (std::is_floating_point_v<Density>) {
    if (!(std::abs(outside) <= kMaxDensityMagnitude))
      refuse("VoxelGrid", "densities must be finite and below 1e30", outside);
  } else if (outside != std::floor(outside)) {
    refuse("VoxelGrid", "outside density must be a whole number, as the voxels are", outside);
  }
  outside_ = static_cast<Density>(outside);

  surface_slopes_ = SurfaceSlopes(size_, voxels, original_range_.min, original_range_.max);

  lay_out();
  const auto* from = voxels.data();
  for (int k = 0; k < size_[2]; ++k)
    for (int j = 0; j < size_[1]; ++j, from += size_[0])
      std::copy(from, from + size_[0], voxels_.begin() + static_cast<std::ptrdiff_t>(index(0, j, k)));
  if (options.keep_original) {
    original_ = voxels_;
    edited_.assign(touched_.size(), 0);
  }
  for (std::size_t b = 0; b < ranges_.size(); ++b) ranges_[b] = scan_range(b);
}

template <class Density>
void VoxelGrid<Density>::lay_out() {
  // A pitch divisible by a high power of two maps a column of voxels onto few cache sets, so such a pitch is
  // lengthened.
  constexpr int kLine = static_cast<int>(64 / sizeof(Density));
  const auto detuned = [](std::int64_t pitch) {
    return static_cast<int>(pitch % (4 * kLine) == 0 ? pitch + 2 : pitch);
  };
  row_ = detuned(size_[0] + 2);
  plane_ = detuned(static_cast<std::int64_t>(row_) * (size_[1] + 2));
  // 64 spare bytes, because kernels load pairs of voxels at the last address.
  voxels_.assign(static_cast<std::size_t>(plane_) * static_cast<std::size_t>(size_[2] + 2) + kLine, outside_);
  for (std::size_t a = 0; a < 3; ++a) bricks_[a] = (size_[a] + kBrick - 1) / kBrick;
  const auto count = static_cast<std::size_t>(bricks_[0]) * static_cast<std::size_t>(bricks_[1]) *
                     static_cast<std::size_t>(bricks_[2]);
  versions_.assign(count, 0);
  ranges_.assign(count, {outside_, outside_});
  const std::size_t rows = brick_row(0, bricks_[2]);
  words_ = static_cast<std::size_t>((bricks_[0] + kWord - 1) / kWord);
  touched_.assign(rows * words_, 0);
  touched_words_.reserve(touched_.size());
  profile_ = static_cast<std::size_t>(bricks_[0] * kBrick + kLowerLanes + 2);
  new_min_.assign(rows * profile_, std::numeric_limits<Density>::max());
  old_max_.assign(rows * profile_, std::numeric_limits<Density>::lowest());
}

template <class Density>
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

template <class Density>
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

template <class Density>
VoxelGrid<Density> VoxelGrid<Density>::cropped(double isovalue, int margin) const {
  if (margin < 0) refuse("VoxelGrid", "crop margin must be >= 0 voxels", margin);
  VoxelBox box = occupied_box(isovalue);
  if (box.empty())
    refuse("VoxelGrid",
           "no voxel reaches the isovalue (densities " + std::to_string(original_range_.min) + " to " +
               std::to_string(original_range_.max) + ")",
           isovalue);
  for (std::size_t a = 0; a < 3; ++a) {
    box.lo[a] -= margin;
    box.hi[a] += std::min(margin, size_[a]);
  }
  return cropped(box);
}

template <class Density>
VoxelGrid<Density> VoxelGrid<Density>::cropped(VoxelBox box) const {
  GridGeometry g{.size = {}, .spacing = spacing_, .X_WG = X_WG_, .outside = static_cast<double>(outside_)};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::string requested = std::to_string(box.lo[a]) + " to " + std::to_string(box.hi[a]);
    box.lo[a] = std::max(box.lo[a], 0);
    box.hi[a] = std::min(box.hi[a], size_[a] - 1);
    if (box.hi[a] < box.lo[a])
      refuse("VoxelGrid", "a box to crop to must have voxels of the grid along every axis", requested);
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
  return VoxelGrid(g, voxels, {.keep_original = !original_.empty()});
}

}  // namespace trephine
