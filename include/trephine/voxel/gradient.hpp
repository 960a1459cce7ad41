// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/sampling.hpp>

/// Gradients of the density, by name. `kSmooth`: normals vary little across a voxel, cells do not show in them. Each
/// policy answers in **density per voxel along each grid axis**; the field divides by the spacing per axis, which is
/// what makes them right on anisotropic grids. Thesis section 2.1.2.
namespace trephine {

/// Gradient of the trilinear interpolant itself: exactly −∇ of what defines the surface, but it jumps from cell to
/// cell. Cost: one cell.
struct AnalyticGradient {
  static constexpr bool kNeedsStored = false;
  static constexpr bool kSmooth = false;
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
  static constexpr bool kSmooth = false;
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
  static constexpr bool kSmooth = false;
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

/// The slope that fits best to the interpolant on a ball of one voxel round the point: 26 samples in the directions and
/// with the weights of Lebedev's rule, Σ w ρ(u + d) d · 3. Normals of a whole neighbourhood instead of a cell: the
/// ripple of single cells averages out, and unlike axis-wise differences it prefers no direction. Cost: 26 samples in
/// two batches.
struct BallGradient {
  static constexpr bool kNeedsStored = false;
  static constexpr bool kSmooth = true;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const VoxelGrid<Density>&, const SampleView<Density, Scalar>& v,
                                       const Vec3<Scalar>& u) noexcept {
    static constexpr Rule<Scalar> kRule;
    std::array<Scalar, kPoints> density;
    sample_points(v, Mat3<Scalar>::Identity().eval(), u, kRule.x.data(), kRule.y.data(), kRule.z.data(), density.data(),
                  kPoints);
    Vec3<Scalar> g = Vec3<Scalar>::Zero();
    for (std::size_t i = 0; i < kPoints; ++i)
      g += (kRule.weight[i] * density[i]) * Vec3<Scalar>(kRule.x[i], kRule.y[i], kRule.z[i]);
    return g;
  }

 private:
  static constexpr int kPoints = 2 * kLane;
  /// Directions to a cube's faces, edges and corners; what is left of the second lane weighs nothing.
  template <RealScalar Scalar>
  struct Rule {
    std::array<Scalar, kPoints> x{}, y{}, z{}, weight{};
    constexpr Rule() {
      constexpr std::array<double, 4> kPerLength{0, 1, 0.70710678118654752, 0.57735026918962576};
      constexpr std::array<double, 4> kWeight{0, 3.0 / 21, 3 * 4.0 / 105, 3 * 9.0 / 280};
      std::size_t n = 0;
      for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i) {
            const auto steps = static_cast<std::size_t>(i * i + j * j + k * k);
            if (steps == 0) continue;
            x[n] = static_cast<Scalar>(i * kPerLength[steps]);
            y[n] = static_cast<Scalar>(j * kPerLength[steps]);
            z[n] = static_cast<Scalar>(k * kPerLength[steps]);
            weight[n++] = static_cast<Scalar>(kWeight[steps]);
          }
    }
  };
};

template <class G>
concept GradientPolicy = std::same_as<G, AnalyticGradient> || std::same_as<G, CentralGradient> ||
    std::same_as<G, StoredGradient> || std::same_as<G, BallGradient>;

}  // namespace trephine
