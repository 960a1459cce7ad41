// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>

/// Rotations as vectors: exponential and logarithm, the turn between two poses, the smallest turn between two
/// directions.
namespace trephine::inline TREPHINE_ALIGNED {

/// Logarithm of a rotation: axis times angle, the angle in [0, π] rad.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> rotation_vector(const Mat3<Scalar>& R) noexcept {
  const Quat<Scalar> q(R);
  const Scalar sign = q.w() < 0 ? Scalar(-1) : Scalar(1);
  const Vec3<Scalar> v = q.vec();
  const Scalar s = v.norm();
  constexpr auto kNoAxis = Scalar(1e-12);  // half angle [rad] below which the axis is undefined: log q ≈ 2 vec(q)
  if (!(s > kNoAxis)) return Scalar(2) * sign * v;
  return (Scalar(2) * sign * std::atan2(s, sign * q.w()) / s) * v;
}

/// Rotation from pose a to pose b as a rotation vector [rad], in the axes of the frame that both poses map to.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> turn_between(const Pose<Scalar>& a, const Pose<Scalar>& b) noexcept {
  const Mat3<Scalar> from = inverse_rotation(a), to = b.linear();
  return rotation_vector<Scalar>(product(to, from));
}

/// Exponential map: the rotation by |w| rad about w. Rodrigues' formula, c I + s [a]× + (1 − c) a aᵀ with a along w.
/// Eigen's AngleAxis takes longer to compile.
template <RealScalar Scalar>
[[nodiscard]] Mat3<Scalar> rotation_from_vector(const Vec3<Scalar>& w) noexcept {
  const Scalar angle = w.norm();
  if (!(angle > Scalar(0))) return Mat3<Scalar>::Identity();
  const Vec3<Scalar> axis = w / angle;
  const Scalar s = std::sin(angle), c = std::cos(angle);
  Mat3<Scalar> R;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index j = (i + 1) % 3, k = (i + 2) % 3;
    const Scalar both = (Scalar(1) - c) * axis[j] * axis[k];
    R(i, i) = c + (Scalar(1) - c) * axis[i] * axis[i];
    R(k, j) = both + s * axis[i];
    R(j, k) = both - s * axis[i];
  }
  return R;
}

/// Smallest rotation that maps the unit vector a to the unit vector b. Vectors opposite to within 6° rotate about an
/// axis nearly perpendicular to both. Closed form, the product of two half turns: Eigen's FromTwoVectors would add a
/// singular value decomposition to every program.
template <RealScalar Scalar>
[[nodiscard]] Mat3<Scalar> rotation_between(const Vec3<Scalar>& a, const Vec3<Scalar>& b) noexcept {
  const auto half_turn = [](const Vec3<Scalar>& axis) -> Mat3<Scalar> {
    return Scalar(2) * axis * axis.transpose() - Mat3<Scalar>::Identity();
  };
  constexpr auto kOpposite = Scalar(0.1);  // |a + b| below this: angle above 174°, where the bisector loses digits
  const Vec3<Scalar> bisector = a + b;
  const Scalar length = bisector.norm();
  if (length < kOpposite) return rotation_between<Scalar>(-a, b) * half_turn(a.unitOrthogonal());
  return half_turn(bisector / length) * half_turn(a);
}

/// Returns the pose X moved to `origin` and turned by the smallest rotation that points its +z along `direction`, of
/// any length; without a direction X only moves.
template <RealScalar Scalar>
[[nodiscard]] Pose<Scalar> pose_along(Pose<Scalar> X, const Vec3<Scalar>& origin,
                                      const Vec3<Scalar>& direction) noexcept {
  X.translation() = origin;
  if (direction.norm() > Scalar(0))
    X.linear() = rotation_between<Scalar>(z_axis(X), direction.normalized()) * X.linear();
  return X;
}

}  // namespace trephine
