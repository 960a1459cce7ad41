// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/density_field.hpp>

#include <cmath>
#include <memory>

namespace trephine {

template <VoxelDensity Density>
class BoneSurfaceView;

/// The surface of a bone at an isovalue. The grid must outlive it and stay where it is in memory.
template <VoxelDensity Density>
class BoneSurface {
 public:
  /// Throws std::invalid_argument for an isovalue that is not finite.
  BoneSurface(const VoxelGrid<Density>& grid, double isovalue) : grid_(&grid), isovalue_(isovalue) {
    if (!std::isfinite(isovalue)) refuse("BoneSurface", "isovalue must be finite", isovalue);
  }

  [[nodiscard]] BoneSurfaceView<Density> view() noexcept { return BoneSurfaceView<Density>(*this); }
  [[nodiscard]] const VoxelGrid<Density>& grid() const noexcept { return *grid_; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }

 private:
  const VoxelGrid<Density>* grid_;
  double isovalue_;
};

/// A BoneSurface as a field in G. A view: cheap to make, valid while the surface lives; haptic thread only.
template <VoxelDensity Density>
class BoneSurfaceView {
 public:
  using Scalar = double;

  explicit BoneSurfaceView(BoneSurface<Density>& surface) noexcept : surface_(&surface) {}

  /// Shortest spacing [m]: the unit of step lengths.
  [[nodiscard]] double voxel() const noexcept { return grid().spacing().minCoeff(); }
  /// Whether all within `radius` [m] of p_G lies beyond the grid, and air is there.
  [[nodiscard]] bool is_beyond(const Vec3d& p_G, double radius) const noexcept {
    return DensityField<Density, double>(grid(), surface_->isovalue()).is_beyond(p_G, radius);
  }
  [[nodiscard]] const VoxelGrid<Density>& grid() const noexcept { return surface_->grid(); }

 private:
  BoneSurface<Density>* surface_;
};

/// The surface of this bone at this isovalue.
template <VoxelDensity Density>
[[nodiscard]] std::shared_ptr<BoneSurface<Density>> share_bone_surface(const VoxelGrid<Density>& grid,
                                                                       double isovalue) {
  return std::make_shared<BoneSurface<Density>>(grid, isovalue);
}

}  // namespace trephine
