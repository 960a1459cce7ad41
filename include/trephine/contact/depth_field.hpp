// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/depth_map.hpp>

namespace trephine {

/// The depth of a DepthMap as a contact field in G: value [m], gradient [1], which is the inward normal up to what
/// interpolation leaves of its length. A view: cheap to make, valid while the map lives; haptic thread only.
template <RealScalar S>
class DepthField {
 public:
  using Scalar = S;

  explicit DepthField(const DepthMap& map) noexcept
      : field_(map.grid(), 0),
        unit_(static_cast<Scalar>(map.unit())),
        half_diagonal_(static_cast<Scalar>(map.grid().spacing().norm() / 2)) {}

  [[nodiscard]] Scalar voxel() const noexcept { return field_.voxel(); }
  /// Metres of depth that a unit of `value` stands for.
  [[nodiscard]] static constexpr Scalar metres() noexcept { return Scalar(1); }
  /// No bone is nearer than this [m] to a point of this value: the interpolant's slope is at most √3, and it is at most
  /// half a voxel's diagonal off the least of a cell's corners.
  [[nodiscard]] Scalar clearance(Scalar value) const noexcept {
    constexpr Scalar kPerSlope = Scalar(0.57735026918962576);
    return std::max({Scalar(0), -value * kPerSlope, -value - half_diagonal_});
  }
  /// Points of lower values have a larger clearance than this [m].
  [[nodiscard]] Scalar value_at_clearance(Scalar clearance) const noexcept {
    constexpr Scalar kSlope = Scalar(1.7320508075688772);
    return -std::min(clearance * kSlope, clearance + half_diagonal_);
  }

  [[nodiscard]] Scalar value(const Vec3<Scalar>& p_G) const noexcept { return unit_ * field_.value(p_G); }
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>& p_G) const noexcept { return unit_ * field_.gradient(p_G); }
  /// Gradient of the mean depth over a ball of one voxel.
  [[nodiscard]] Vec3<Scalar> smooth_gradient(const Vec3<Scalar>& p_G) const noexcept {
    return unit_ * field_.smooth_gradient(p_G);
  }
  [[nodiscard]] bool normal(const Vec3<Scalar>& p_G, Vec3<Scalar>& n) const noexcept { return field_.normal(p_G, n); }

  void values(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* out,
              int n) const noexcept {
    field_.values(X, x, y, z, out, n);
    for (int i = 0; i < n; ++i) out[i] *= unit_;
  }
  void gradients(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy,
                 Scalar* gz, int n) const noexcept {
    field_.gradients(X, x, y, z, gx, gy, gz, n);
    for (int i = 0; i < n; ++i) gx[i] *= unit_;
    for (int i = 0; i < n; ++i) gy[i] *= unit_;
    for (int i = 0; i < n; ++i) gz[i] *= unit_;
  }

 private:
  DensityField<std::int16_t, Scalar> field_;
  Scalar unit_;
  Scalar half_diagonal_;
};

}  // namespace trephine
