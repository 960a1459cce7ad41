// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/render/line/first_contact.hpp>

#include <cmath>

/// Equations 1 to 5 of the thesis: where the shaft's centreline meets bone on its way from t−1 to t (section 3.1).
namespace trephine::inline TREPHINE_ALIGNED {

/// Eq. 1: fraction of the step n−1 to n at which a vertex meets the isosurface, by the field's values (density minus
/// isovalue) before and after it. A vertex that was in bone before the step has 0.
template <RealScalar Scalar>
[[nodiscard]] Scalar eq_1_fraction(Scalar before, Scalar now) noexcept {
  return before < Scalar(0) ? -before / (now - before) : Scalar(0);
}
/// Eq. 2: IntP = (1 − f) V_{n−1} + f V_n.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> eq_2_intersection(Scalar f, const Vec3<Scalar>& before, const Vec3<Scalar>& now) noexcept {
  return (Scalar(1) - f) * before + f * now;
}
/// Eq. 3: the line of t−1, translated by a fraction of the way to the tip of t.
template <RealScalar Scalar>
[[nodiscard]] Centreline<Scalar> eq_3_translated(const Centreline<Scalar>& from, const Centreline<Scalar>& to,
                                                 Scalar fraction) noexcept {
  return {from.tip + fraction * (to.tip - from.tip), from.direction};
}
/// Eq. 4: the translated line, rotated by a fraction of the angle to the direction of t. Opposite lines rotate about
/// any perpendicular axis.
template <RealScalar Scalar>
[[nodiscard]] Centreline<Scalar> eq_4_rotated(const Centreline<Scalar>& from, const Centreline<Scalar>& to,
                                              Scalar fraction) noexcept {
  constexpr auto kParallel = Scalar(1e-9);  // sine of the angle below which the lines have no common normal
  const Vec3<Scalar> cross = from.direction.cross(to.direction);
  const Scalar sine = cross.norm();
  const Vec3<Scalar> axis = sine > kParallel ? Vec3<Scalar>(cross / sine) : from.direction.unitOrthogonal();
  const Scalar angle = std::atan2(sine, from.direction.dot(to.direction));
  return {to.tip, Eigen::AngleAxis<Scalar>(fraction * angle, axis) * from.direction};
}
/// Eq. 5: every vertex moves by a fraction of its own ray a_i from t−1 to t.
template <RealScalar Scalar>
[[nodiscard]] Centreline<Scalar> eq_5_ray_cast(const Centreline<Scalar>& from, const Centreline<Scalar>& to,
                                               Scalar fraction) noexcept {
  return {from.tip + fraction * (to.tip - from.tip), from.direction + fraction * (to.direction - from.direction)};
}

}  // namespace trephine
