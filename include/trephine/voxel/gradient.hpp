// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/sampling.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>

/// Policies that estimate the density's gradient. Each returns **density per voxel along each grid axis**; the field
/// divides by the spacing of each axis, so results are right on anisotropic grids. Thesis section 2.1.2.
namespace trephine::inline TREPHINE_ALIGNED {

/// A gradient estimator. `kSmooth` is true if normals vary little across a voxel, so that cells do not show in them.
/// `at(view, u)` returns the gradient at voxel coordinates u of the padded array.
template <class G>
concept GradientPolicy = requires(const SampleView<std::int16_t, double>& view, const Vec3<double>& u) {
  { G::kSmooth } -> std::convertible_to<bool>;
  { G::at(view, u) } noexcept -> std::same_as<Vec3<double>>;
};

/// A policy with a batched form: `at_points` takes the arguments of `sample_gradients`.
template <class G>
concept BatchedGradientPolicy =
    GradientPolicy<G> && requires(const SampleView<std::int16_t, double>& view, const Mat3<double>& A,
                                  const Vec3<double>& t, const double* in, double* out) {
      { G::at_points(view, A, t, in, in, in, out, out, out, kLane) } noexcept;
    };

/// The exact gradient of the trilinear interpolant, whose isosurface is the bone's surface. It jumps from cell to cell.
/// Cost: one cell.
struct AnalyticGradient {
  static constexpr bool kSmooth = false;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const SampleView<Density, Scalar>& v, const Vec3<Scalar>& u) noexcept {
    const Cell<Scalar> c = cell_at(v, u);
    const auto r = corners(v, c.base);
    const Scalar dx = lerp(lerp(r[1] - r[0], r[3] - r[2], c.fy), lerp(r[5] - r[4], r[7] - r[6], c.fy), c.fz);
    const Scalar dy = lerp(lerp(r[2] - r[0], r[3] - r[1], c.fx), lerp(r[6] - r[4], r[7] - r[5], c.fx), c.fz);
    const Scalar dz = lerp(lerp(r[4] - r[0], r[5] - r[1], c.fx), lerp(r[6] - r[2], r[7] - r[3], c.fx), c.fy);
    return {dx, dy, dz};
  }
  template <VoxelDensity Density, RealScalar Scalar>
  static void at_points(const SampleView<Density, Scalar>& v, const Mat3<Scalar>& A, const Vec3<Scalar>& t,
                        const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy, Scalar* gz,
                        int n) noexcept {
    sample_gradients(v, A, t, x, y, z, gx, gy, gz, n);
  }
};

/// Central difference of the interpolant, one voxel to either side: continuous, and twice as wide as a cell. It equals
/// the trilinear interpolation of central differences at the voxels, which the thesis stores. Cost: six samples.
struct CentralGradient {
  static constexpr bool kSmooth = false;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const SampleView<Density, Scalar>& v, const Vec3<Scalar>& u) noexcept {
    Vec3<Scalar> g;
    for (int a = 0; a < 3; ++a) {
      Vec3<Scalar> d = Vec3<Scalar>::Zero();
      d[a] = Scalar(1);
      g[a] = Scalar(0.5) * (sample(v, Vec3<Scalar>(u + d)) - sample(v, Vec3<Scalar>(u - d)));
    }
    return g;
  }
};

/// Gradient of the cubic B-spline whose control points are the voxels. It is smooth across cells, so the ripple of
/// single cells averages out, and exact for linear densities. Cost: 64 voxels.
struct SplineGradient {
  static constexpr bool kSmooth = true;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const SampleView<Density, Scalar>& v, const Vec3<Scalar>& u) noexcept {
    const Cell<Scalar> c = cell_at(v, u);
    const SplineWeights<Scalar> x(c.fx), y(c.fy), z(c.fz);
    std::array<Scalar, 64> voxels;
    copy_voxels(v, u, c.base, voxels);
    // Sums over y and z for each of four voxels along x: of the values, and of the slopes along y and z.
    Four<Scalar> values = Four<Scalar>::Zero(), slopes_y = values, slopes_z = values;
    for (std::size_t k = 0; k < 4; ++k) {
      Four<Scalar> mean = Four<Scalar>::Zero(), slope = mean;
      for (std::size_t j = 0; j < 4; ++j) {
        const Four<Scalar> density = Four<Scalar>::Map(voxels.data() + 16 * k + 4 * j);
        mean += y.weight[j] * density;
        slope += y.slope[j] * density;
      }
      values += z.weight[k] * mean;
      slopes_y += z.weight[k] * slope;
      slopes_z += z.slope[k] * mean;
    }
    const Four<Scalar> weight = x.four(x.weight);
    return {(x.four(x.slope) * values).sum(), (weight * slopes_y).sum(), (weight * slopes_z).sum()};
  }

 private:
  template <RealScalar Scalar>
  using Four = Eigen::Array<Scalar, 4, 1>;

  /// The spline's weights of four consecutive voxels, and their derivatives, at a point f in [0, 1] past the second.
  template <RealScalar Scalar>
  struct SplineWeights {
    // Arrays of scalars, because the weights along y and z are used singly.
    std::array<Scalar, 4> weight, slope;
    explicit SplineWeights(Scalar f) noexcept {
      constexpr Scalar kSixth = Scalar(1) / Scalar(6);
      const Scalar g = Scalar(1) - f;
      weight = {g * g * g * kSixth, (f * f * (Scalar(3) * f - Scalar(6)) + Scalar(4)) * kSixth,
                (g * g * (Scalar(3) * g - Scalar(6)) + Scalar(4)) * kSixth, f * f * f * kSixth};
      slope = {Scalar(-0.5) * g * g, f * (Scalar(1.5) * f - Scalar(2)), -g * (Scalar(1.5) * g - Scalar(2)),
               Scalar(0.5) * f * f};
    }
    [[nodiscard]] static Four<Scalar> four(const std::array<Scalar, 4>& x) noexcept { return {x[0], x[1], x[2], x[3]}; }
  };

  /// Copies the 4 x 4 x 4 voxels around the cell of u as Scalars. A separate loop, because compilers vectorise it.
  template <VoxelDensity Density, RealScalar Scalar>
  [[gnu::always_inline]] static void copy_voxels(const SampleView<Density, Scalar>& v, const Vec3<Scalar>& u, int base,
                                                 std::array<Scalar, 64>& to) noexcept {
    if (!((u.array() >= Scalar(1)).all() && (u.array() < v.last.array() - Scalar(1)).all()))
      return copy_at_border(v, base, to);
    const Density* first = v.voxels + base - v.plane - v.row - 1;
    auto next = to.begin();
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j, next += 4)
        for (int i = 0; i < 4; ++i) next[i] = static_cast<Scalar>(first[k * v.plane + j * v.row + i]);
  }

  /// The same at the array's border, which continues with its last voxels.
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

}  // namespace trephine
