// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/sampling.hpp>

/// Gradients of the density, by name. Each policy answers in **density per voxel along each grid axis**; the field
/// divides by the spacing per axis, which is what makes them right on anisotropic grids. Thesis section 2.1.2.
namespace trephine {

/// Gradient of the trilinear interpolant itself: exactly −∇ of what defines the surface, but it jumps from cell to
/// cell. Cost: one cell.
struct AnalyticGradient {
  static constexpr bool kNeedsStored = false;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const VoxelGrid<Density>&, const SampleView<Density, Scalar>& v,
                                       const Vec3<Scalar>& u) noexcept {
    const Cell<Scalar> c = cell_at(v, u);
    const auto r = corners(v, c.base);
    const Scalar dx = lerp(lerp(r[1] - r[0], r[3] - r[2], c.fy), lerp(r[5] - r[4], r[7] - r[6], c.fy), c.fz);
    const Scalar dy = lerp(lerp(r[2] - r[0], r[3] - r[1], c.fx), lerp(r[6] - r[4], r[7] - r[5], c.fx), c.fz);
    const Scalar dz = lerp(lerp(r[4] - r[0], r[5] - r[1], c.fx), lerp(r[6] - r[2], r[7] - r[3], c.fx), c.fy);
    return {dx, dy, dz};
  }
};

/// Central difference of the interpolant over one voxel either side: continuous, twice as wide. Cost: six samples.
struct CentralGradient {
  static constexpr bool kNeedsStored = false;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const VoxelGrid<Density>&, const SampleView<Density, Scalar>& v,
                                       const Vec3<Scalar>& u) noexcept {
    Vec3<Scalar> g;
    for (int a = 0; a < 3; ++a) {
      Vec3<Scalar> d = Vec3<Scalar>::Zero();
      d[a] = Scalar(1);
      g[a] = Scalar(0.5) * (sample(v, Vec3<Scalar>(u + d)) - sample(v, Vec3<Scalar>(u - d)));
    }
    return g;
  }
};

/// The thesis' way: a central difference kept per voxel, updated where milling changed the densities, interpolated
/// trilinearly. In exact arithmetic the same as `CentralGradient` except where that one reaches past the border; it
/// trades memory (`GridOptions::stored_gradients`) for samples. Cost: one cell of three numbers.
struct StoredGradient {
  static constexpr bool kNeedsStored = true;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const VoxelGrid<Density>& grid, const SampleView<Density, Scalar>& v,
                                       const Vec3<Scalar>& u) noexcept {
    const Cell<Scalar> c = cell_at(v, u);
    Vec3<Scalar> g = Vec3<Scalar>::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner & 1;
      const int y = (corner >> 1) & 1;
      const int z = corner >> 2;
      const Scalar w =
          (x != 0 ? c.fx : Scalar(1) - c.fx) * (y != 0 ? c.fy : Scalar(1) - c.fy) * (z != 0 ? c.fz : Scalar(1) - c.fz);
      const auto* d = grid.differences() + 3 * static_cast<std::ptrdiff_t>(c.base + z * v.plane + y * v.row + x);
      g += (Scalar(0.5) * w) * Vec3<Scalar>(Scalar(d[0]), Scalar(d[1]), Scalar(d[2]));
    }
    return g;
  }
};

template <class G>
concept GradientPolicy =
    std::same_as<G, AnalyticGradient> || std::same_as<G, CentralGradient> || std::same_as<G, StoredGradient>;

}  // namespace trephine
