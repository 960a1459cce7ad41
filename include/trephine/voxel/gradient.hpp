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

/// Gradient of the densities smoothed by the cubic B-spline (its control points are the voxels themselves): smooth
/// where the interpolant has kinks, so that the ripple of single cells averages out, and exact for linear densities.
/// Cost: 64 voxels.
struct SplineGradient {
  static constexpr bool kNeedsStored = false;
  static constexpr bool kSmooth = true;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const VoxelGrid<Density>&, const SampleView<Density, Scalar>& v,
                                       const Vec3<Scalar>& u) noexcept {
    const Cell<Scalar> c = cell_at(v, u);
    const Taps<Scalar> x(c.fx), y(c.fy), z(c.fz);
    std::array<Scalar, 64> around;
    copy(v, u, c.base, around);
    Four<Scalar> in_x = Four<Scalar>::Zero(), in_y = in_x, in_z = in_x;  // sums over y and z, for each tap along x
    for (std::size_t k = 0; k < 4; ++k) {
      Four<Scalar> mean = Four<Scalar>::Zero(), rise = mean;
      for (std::size_t j = 0; j < 4; ++j) {
        const Four<Scalar> density = Four<Scalar>::Map(around.data() + 16 * k + 4 * j);
        mean += y.weight[j] * density;
        rise += y.slope[j] * density;
      }
      in_x += z.weight[k] * mean;
      in_y += z.weight[k] * rise;
      in_z += z.slope[k] * mean;
    }
    const Four<Scalar> weight = x.four(x.weight);
    return {(x.four(x.slope) * in_x).sum(), (weight * in_y).sum(), (weight * in_z).sum()};
  }

 private:
  template <RealScalar Scalar>
  using Four = Eigen::Array<Scalar, 4, 1>;

  /// Of the four voxels round a place f beyond the second of them: the spline's weights and their derivatives.
  template <RealScalar Scalar>
  struct Taps {
    // Numbers, not vectors: those along y and z are used one by one.
    std::array<Scalar, 4> weight, slope;
    explicit Taps(Scalar f) noexcept {
      constexpr Scalar kSixth = Scalar(1) / Scalar(6);
      const Scalar g = Scalar(1) - f;
      weight = {g * g * g * kSixth, (f * f * (Scalar(3) * f - Scalar(6)) + Scalar(4)) * kSixth,
                (g * g * (Scalar(3) * g - Scalar(6)) + Scalar(4)) * kSixth, f * f * f * kSixth};
      slope = {Scalar(-0.5) * g * g, f * (Scalar(1.5) * f - Scalar(2)), -g * (Scalar(1.5) * g - Scalar(2)),
               Scalar(0.5) * f * f};
    }
    [[nodiscard]] static Four<Scalar> four(const std::array<Scalar, 4>& x) noexcept { return {x[0], x[1], x[2], x[3]}; }
  };

  /// The 4 x 4 x 4 voxels round the cell of u. Turned into Scalar in a loop of its own, which compilers vectorise.
  template <VoxelDensity Density, RealScalar Scalar>
  [[gnu::always_inline]] static void copy(const SampleView<Density, Scalar>& v, const Vec3<Scalar>& u, int base,
                                          std::array<Scalar, 64>& to) noexcept {
    if (!((u.array() >= Scalar(1)).all() && (u.array() < v.last.array() - Scalar(1)).all()))
      return copy_at_border(v, base, to);
    const Density* first = v.voxels + base - v.plane - v.row - 1;
    auto next = to.begin();
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j, next += 4)
        for (int i = 0; i < 4; ++i) next[i] = static_cast<Scalar>(first[k * v.plane + j * v.row + i]);
  }

  /// The 4 x 4 x 4 voxels round a cell, some of which lie beyond the array: there the border goes on.
  template <VoxelDensity Density, RealScalar Scalar>
  static void copy_at_border(const SampleView<Density, Scalar>& v, int base, std::array<Scalar, 64>& to) noexcept {
    const std::array<int, 3> cell{base % v.row, base % v.plane / v.row, base / v.plane};
    const auto offset = [&](int axis, int tap, int pitch) {
      return std::clamp(cell[static_cast<std::size_t>(axis)] - 1 + tap, 0, static_cast<int>(v.last[axis])) * pitch;
    };
    auto next = to.begin();
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
          *next++ = static_cast<Scalar>(v.voxels[offset(2, k, v.plane) + offset(1, j, v.row) + offset(0, i, 1)]);
  }
};

template <class G>
concept GradientPolicy = std::same_as<G, AnalyticGradient> || std::same_as<G, CentralGradient> ||
    std::same_as<G, StoredGradient> || std::same_as<G, SplineGradient>;

}  // namespace trephine
