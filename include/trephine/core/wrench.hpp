// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Force [N] and torque [N·m] **on the tool**, which the device applies to the hand. Bone pushes the tool out: at a
/// contact the force points along the outward surface normal. The torque is about T's origin, the burr's centre. Both
/// are in W axes unless a name carries another frame (`f_T_G`).
template <RealScalar Scalar>
struct Wrench {
  Vec3<Scalar> force = Vec3<Scalar>::Zero();
  Vec3<Scalar> torque = Vec3<Scalar>::Zero();

  [[nodiscard]] static Wrench zero() noexcept { return {}; }

  /// Wrench of a force `f` [N] that acts at `r` [m] from the reference point.
  [[nodiscard]] static Wrench of_force_at(const Vec3<Scalar>& f, const Vec3<Scalar>& r) noexcept {
    return {f, r.cross(f)};
  }

  /// The same action with its torque about another reference point, at `r` [m] from the present point.
  [[nodiscard]] Wrench about(const Vec3<Scalar>& r) const noexcept { return {force, torque - r.cross(force)}; }

  /// The same wrench with components in the axes that R maps to.
  [[nodiscard]] Wrench rotated(const Mat3<Scalar>& R) const noexcept { return {product(R, force), product(R, torque)}; }

  template <RealScalar Other>
  [[nodiscard]] Wrench<Other> cast() const noexcept {
    return {force.template cast<Other>(), torque.template cast<Other>()};
  }

  Wrench& operator+=(const Wrench& o) noexcept {
    force += o.force;
    torque += o.torque;
    return *this;
  }
  Wrench& operator*=(Scalar s) noexcept {
    force *= s;
    torque *= s;
    return *this;
  }
  [[nodiscard]] friend Wrench operator+(Wrench a, const Wrench& b) noexcept { return a += b; }
  [[nodiscard]] friend Wrench operator*(Scalar s, Wrench a) noexcept { return a *= s; }
  [[nodiscard]] friend bool operator==(const Wrench& a, const Wrench& b) noexcept {
    return a.force == b.force && a.torque == b.torque;
  }
};

using Wrenchd = Wrench<double>;

template <RealScalar Scalar>
[[nodiscard]] bool is_finite(const Wrench<Scalar>& w) noexcept {
  return is_finite(w.force) && is_finite(w.torque);
}

/// Linear velocity of T's origin [m/s] and angular velocity [rad/s], in W axes.
struct Twist {
  Vec3d linear = Vec3d::Zero();
  Vec3d angular = Vec3d::Zero();
};

}  // namespace trephine
