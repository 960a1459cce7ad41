// SPDX-License-Identifier: MIT
#pragma once

#include "support/raster.hpp"

#include <trephine/contact/surface_search.hpp>
#include <trephine/voxel/density_field.hpp>

#include <cstdint>

/// Fields for contact code that are not voxels: an analytic shape, and a wrapper that counts samples.
namespace trephine::test {

/// A shape as a contact field: its value is the depth in the bone, in voxels of a size that is stated.
template <RealScalar S, class Shape>
class ShapeField {
 public:
  using Scalar = S;
  ShapeField(Shape shape, double voxel) : shape_(std::move(shape)), voxel_(voxel) {}

  [[nodiscard]] Scalar voxel() const noexcept { return static_cast<Scalar>(voxel_); }
  [[nodiscard]] Scalar value(const Vec3<Scalar>& p) const noexcept {
    return static_cast<Scalar>(-shape_(p.template cast<double>()) / voxel_);
  }
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>& p) const noexcept {
    return (-outward_normal(shape_, p.template cast<double>()) / voxel_).template cast<Scalar>();
  }
  [[nodiscard]] bool normal(const Vec3<Scalar>& p, Vec3<Scalar>& n) const noexcept {
    n = outward_normal(shape_, p.template cast<double>()).template cast<Scalar>();
    return true;
  }
  void values(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* out,
              int n) const noexcept {
    for (int i = 0; i < n; ++i) out[i] = value(X * Vec3<Scalar>(x[i], y[i], z[i]));
  }
  void gradients(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy,
                 Scalar* gz, int n) const noexcept {
    for (int i = 0; i < n; ++i) {
      const Vec3<Scalar> g = gradient(X * Vec3<Scalar>(x[i], y[i], z[i]));
      gx[i] = g.x();
      gy[i] = g.y();
      gz[i] = g.z();
    }
  }

 private:
  Shape shape_;
  double voxel_;
};

/// Counts what is asked of a field: points sampled (batched ones each), how many of them one at a time, and normals.
template <class Base>
class CountingField {
 public:
  using Scalar = typename Base::Scalar;
  static constexpr bool kSmoothNormals = trephine::kSmoothNormals<Base>;
  static constexpr bool kTrilinear = trephine::kTrilinear<Base>;
  explicit CountingField(const Base& base) : base_(&base) {}

  mutable std::int64_t samples = 0;
  mutable std::int64_t ones = 0;
  mutable std::int64_t normals = 0;

  [[nodiscard]] Scalar voxel() const noexcept { return base_->voxel(); }
  [[nodiscard]] Scalar value(const Vec3<Scalar>& p) const noexcept {
    ++samples;
    ++ones;
    return base_->value(p);
  }
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>& p) const noexcept { return base_->gradient(p); }
  [[nodiscard]] bool normal(const Vec3<Scalar>& p, Vec3<Scalar>& n) const noexcept {
    ++normals;
    return base_->normal(p, n);
  }
  void values(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* out,
              int n) const noexcept {
    samples += n;
    base_->values(X, x, y, z, out, n);
  }
  void gradients(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy,
                 Scalar* gz, int n) const noexcept {
    normals += n;
    base_->gradients(X, x, y, z, gx, gy, gz, n);
  }
  /// Not counted.
  [[nodiscard]] auto smooth() const noexcept
    requires requires(const Base& base) { base.smooth(); }
  {
    return base_->smooth();
  }

 private:
  const Base* base_;
};

template <class Scalar, class Gradient = AnalyticGradient, class Density>
[[nodiscard]] DensityField<Density, Scalar, Gradient> field_of(const VoxelGrid<Density>& grid, const RasterOptions& o) {
  return {grid, o.isovalue()};
}

/// A scalar and a gradient to test with.
template <RealScalar S, GradientPolicy G>
struct ScalarAndGradient {
  using Scalar = S;
  using Gradient = G;
};
template <RealScalar S>
using CellNormals = ScalarAndGradient<S, AnalyticGradient>;
template <RealScalar S>
using SplineNormals = ScalarAndGradient<S, SplineGradient>;

}  // namespace trephine::test
