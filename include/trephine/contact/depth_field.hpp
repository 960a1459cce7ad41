// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/depth_map.hpp>

#include <cmath>

namespace trephine {

/// The depth of a DepthMap as a contact field in G: value [m], gradient [1], which is the inward normal up to what
/// interpolation leaves of its length. A view: cheap to make, valid while the map lives; haptic thread only.
///
/// Beyond the outermost voxels, where tools stand in air, it goes on from the nearest of them, d away with depth φ:
/// φ − d where bone is cut off there, −√(φ² + d²) elsewhere. The grid is convex, so bone in it is at least as far.
template <RealScalar S>
class DepthField {
 public:
  using Scalar = S;

  explicit DepthField(const DepthMap& map) noexcept
      : field_(map.grid(), 0),
        unit_(static_cast<Scalar>(map.unit())),
        last_((Vec3d(map.grid().size()[0], map.grid().size()[1], map.grid().size()[2]) - Vec3d::Ones())
                  .cwiseProduct(map.grid().spacing())
                  .template cast<Scalar>()),
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
  [[nodiscard]] std::uint64_t rise_stamp() const noexcept { return field_.rise_stamp(); }

  [[nodiscard]] Scalar value(const Vec3<Scalar>& p_G) const noexcept {
    return is_beyond(p_G) ? value_beyond(p_G) : unit_ * field_.value(p_G);
  }
  [[nodiscard]] Vec3<Scalar> gradient(const Vec3<Scalar>& p_G) const noexcept {
    return is_beyond(p_G) ? gradient_beyond(p_G) : Vec3<Scalar>(unit_ * field_.gradient(p_G));
  }
  /// Second derivatives [1/m].
  [[nodiscard]] Mat3<Scalar> hessian(const Vec3<Scalar>& p_G) const noexcept {
    return is_beyond(p_G) ? hessian_beyond(p_G) : Mat3<Scalar>(unit_ * field_.hessian(p_G));
  }
  /// Gradient of the smoothed depth (`SplineGradient`).
  [[nodiscard]] Vec3<Scalar> smooth_gradient(const Vec3<Scalar>& p_G) const noexcept {
    return unit_ * field_.smooth_gradient(p_G);
  }
  /// The smoothed depth, and its gradient; beyond the outermost voxels the depth itself.
  [[nodiscard]] Scalar smooth(const Vec3<Scalar>& p_G, Vec3<Scalar>& gradient) const noexcept {
    const Scalar value = unit_ * field_.smooth(p_G, gradient);
    gradient *= unit_;
    return is_beyond(p_G) ? value_beyond(p_G) : value;
  }
  /// The same, and its second derivatives.
  [[nodiscard]] Scalar smooth(const Vec3<Scalar>& p_G, Vec3<Scalar>& gradient, Mat3<Scalar>& bend) const noexcept {
    const Scalar value = unit_ * field_.smooth(p_G, gradient, bend);
    gradient *= unit_;
    bend *= unit_;
    return is_beyond(p_G) ? value_beyond(p_G) : value;
  }
  [[nodiscard]] bool normal(const Vec3<Scalar>& p_G, Vec3<Scalar>& n) const noexcept { return field_.normal(p_G, n); }

  void values(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* out,
              int n) const noexcept {
    field_.values(X, x, y, z, out, n);
    for (int i = 0; i < n; ++i) out[i] *= unit_;
    each_beyond(X, x, y, z, n, [&](int i, const Vec3<Scalar>& p) { out[i] = value_beyond(p); });
  }
  void gradients(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy,
                 Scalar* gz, int n) const noexcept {
    field_.gradients(X, x, y, z, gx, gy, gz, n);
    for (int i = 0; i < n; ++i) gx[i] *= unit_;
    for (int i = 0; i < n; ++i) gy[i] *= unit_;
    for (int i = 0; i < n; ++i) gz[i] *= unit_;
    each_beyond(X, x, y, z, n, [&](int i, const Vec3<Scalar>& p) {
      const Vec3<Scalar> g = gradient_beyond(p);
      gx[i] = g.x();
      gy[i] = g.y();
      gz[i] = g.z();
    });
  }

 private:
  [[nodiscard]] bool is_beyond(const Vec3<Scalar>& p) const noexcept {
    return p.x() < 0 || p.x() > last_.x() || p.y() < 0 || p.y() > last_.y() || p.z() < 0 || p.z() > last_.z();
  }

  [[nodiscard]] Scalar value_beyond(const Vec3<Scalar>& p) const noexcept {
    const Vec3<Scalar> edge = p.cwiseMax(Scalar(0)).cwiseMin(last_);
    const Scalar depth = unit_ * field_.value(edge);
    const Scalar d = (p - edge).norm();
    return depth > 0 ? depth - d : -std::sqrt(depth * depth + d * d);
  }

  [[nodiscard]] Vec3<Scalar> gradient_beyond(const Vec3<Scalar>& p) const noexcept {
    const Vec3<Scalar> edge = p.cwiseMax(Scalar(0)).cwiseMin(last_);
    const Scalar depth = unit_ * field_.value(edge);
    const Vec3<Scalar> away = p - edge;
    Vec3<Scalar> g = unit_ * field_.gradient(edge);
    for (int axis = 0; axis < 3; ++axis)
      if (away[axis] != 0) g[axis] = 0;  // the edge's point stays where it is
    if (depth > 0) return g - away / away.norm();
    return -(depth * g + away) / std::sqrt(depth * depth + away.squaredNorm());
  }

  [[nodiscard]] Mat3<Scalar> hessian_beyond(const Vec3<Scalar>& p) const noexcept {
    const Vec3<Scalar> edge = p.cwiseMax(Scalar(0)).cwiseMin(last_);
    const Scalar depth = unit_ * field_.value(edge);
    const Vec3<Scalar> away = p - edge;
    const Vec3<Scalar> off = (away.array() != Scalar(0)).template cast<Scalar>();  // along these axes the edge stays
    const Vec3<Scalar> on = Vec3<Scalar>::Ones() - off;
    const Mat3<Scalar> H = on.asDiagonal() * Mat3<Scalar>(unit_ * field_.hessian(edge)) * on.asDiagonal();
    const Mat3<Scalar> M = off.asDiagonal();
    if (depth > 0) {
      const Vec3<Scalar> u = away / away.norm();
      return H - (M - u * u.transpose()) / away.norm();
    }
    const Vec3<Scalar> g = on.cwiseProduct(unit_ * field_.gradient(edge));
    const Scalar r = std::sqrt(depth * depth + away.squaredNorm());
    const Vec3<Scalar> rise = (depth * g + away) / r;
    return (rise * rise.transpose() - g * g.transpose() - depth * H - M) / r;
  }

  /// Calls do_it(i, p) with the points that lie beyond the outermost voxels, if there are any.
  template <class F>
  void each_beyond(const Pose<Scalar>& X, const Scalar* x, const Scalar* y, const Scalar* z, int n,
                   F&& do_it) const noexcept {
    const Mat3<Scalar> R = X.linear();
    const Vec3<Scalar> t = X.translation();
    const Scalar hx = last_.x(), hy = last_.y(), hz = last_.z();
    const Scalar r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2),
                 r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2), tx = t.x(), ty = t.y(), tz = t.z();
    for (int first = 0; first < n; first += kLane) {
      int beyond = 0;
      for (int i = first; i < first + kLane; ++i) {
        const Scalar px = r00 * x[i] + r01 * y[i] + r02 * z[i] + tx;
        const Scalar py = r10 * x[i] + r11 * y[i] + r12 * z[i] + ty;
        const Scalar pz = r20 * x[i] + r21 * y[i] + r22 * z[i] + tz;
        beyond |= static_cast<int>(px < 0) | static_cast<int>(px > hx) | static_cast<int>(py < 0) |
                  static_cast<int>(py > hy) | static_cast<int>(pz < 0) | static_cast<int>(pz > hz);
      }
      if (beyond == 0) continue;
      for (int i = first; i < first + kLane; ++i) {
        const Vec3<Scalar> p = R * Vec3<Scalar>(x[i], y[i], z[i]) + t;
        if (is_beyond(p)) do_it(i, p);
      }
    }
  }

  DensityField<std::int16_t, Scalar> field_;
  Scalar unit_;
  Vec3<Scalar> last_;  // where the last voxel is, in G [m]
  Scalar half_diagonal_;
};

}  // namespace trephine
