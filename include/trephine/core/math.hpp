// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <trephine/core/finite.hpp>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

/// Vectors, rotations and rigid poses, with validity checks. Frames follow monogram notation: W world, G grid, T tool
/// tip, D device, P proxy. `p_WT` is the position of T's origin in W. `X_WG` maps coordinates of G to coordinates of W:
/// `p_WQ = X_WG * p_GQ`. Units are SI throughout: metres, seconds, newtons.
namespace trephine::inline TREPHINE_ALIGNED {

static_assert(EIGEN_VERSION_AT_LEAST(3, 4, 0),
              "trephine needs Eigen 3.4: an older version comes first in the include path");

/// The two supported precisions. The set is closed: tolerances and SIMD code are written for these two types.
template <class Scalar>
concept RealScalar = std::same_as<Scalar, float> || std::same_as<Scalar, double>;

template <RealScalar Scalar>
using Vec3 = Eigen::Matrix<Scalar, 3, 1>;
template <RealScalar Scalar>
using Mat3 = Eigen::Matrix<Scalar, 3, 3>;
template <RealScalar Scalar>
using Quat = Eigen::Quaternion<Scalar>;
/// Rigid transform: rotation and translation [m].
template <RealScalar Scalar>
using Pose = Eigen::Transform<Scalar, 3, Eigen::Isometry>;

using Vec3d = Vec3<double>;
using Mat3d = Mat3<double>;
using Quatd = Quat<double>;
using Posed = Pose<double>;

/// Pose with rotation R and translation p [m].
template <RealScalar Scalar>
[[nodiscard]] Pose<Scalar> make_pose(const Mat3<Scalar>& R, const Vec3<Scalar>& p) {
  auto X = Pose<Scalar>::Identity();
  X.linear() = R;
  X.translation() = p;
  return X;
}

/// Rᵀ, for a rotation its inverse. Eigen's expression takes longer to compile.
template <RealScalar Scalar>
[[nodiscard]] Mat3<Scalar> transposed(const Mat3<Scalar>& R) noexcept {
  Mat3<Scalar> T;
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i) T(i, j) = R(j, i);
  return T;
}

/// Rotation of X⁻¹: from the frame that X maps to, back to the frame that X maps from.
template <RealScalar Scalar>
[[nodiscard]] Mat3<Scalar> inverse_rotation(const Pose<Scalar>& X) noexcept {
  return transposed<Scalar>(X.linear());
}

/// A b. Eigen's expression takes longer to compile.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> product(const Mat3<Scalar>& A, const Vec3<Scalar>& b) noexcept {
  const auto entry = [&](Eigen::Index i) { return A(i, 0) * b[0] + (A(i, 1) * b[1] + A(i, 2) * b[2]); };
  return {entry(0), entry(1), entry(2)};
}

/// A B, likewise.
template <RealScalar Scalar>
[[nodiscard]] Mat3<Scalar> product(const Mat3<Scalar>& A, const Mat3<Scalar>& B) noexcept {
  Mat3<Scalar> C;
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i) C(i, j) = A(i, 0) * B(0, j) + (A(i, 1) * B(1, j) + A(i, 2) * B(2, j));
  return C;
}

/// X⁻¹. Eigen's expression takes longer to compile.
template <RealScalar Scalar>
[[nodiscard]] Pose<Scalar> inverse(const Pose<Scalar>& X) noexcept {
  const Mat3<Scalar> R = inverse_rotation(X);
  const Vec3<Scalar> p = X.translation();
  return make_pose<Scalar>(R, -product(R, p));
}

/// Pose X_AC of C in A, of the poses of B in A and of C in B: their product. Eigen's takes longer to compile.
[[nodiscard]] inline Posed compose(const Posed& X_AB, const Posed& X_BC) noexcept {
  const Mat3d R_AB = X_AB.linear(), R_BC = X_BC.linear();
  const Vec3d p_AB = X_AB.translation(), p_BC = X_BC.translation();
  return make_pose<double>(product(R_AB, R_BC), p_AB + product(R_AB, p_BC));
}

/// Direction of the z axis of the frame that X maps from. That of a tool points along its shaft, toward the handle.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> z_axis(const Pose<Scalar>& X) noexcept {
  return X.linear().col(2);
}

/// v in single precision. Eigen's cast takes longer to compile.
[[nodiscard]] inline Vec3<float> to_float(const Vec3d& v) noexcept {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// True if no component is NaN or infinite.
template <RealScalar Scalar>
[[nodiscard]] bool is_finite(const Vec3<Scalar>& v) noexcept {
  return is_finite(v.x()) && is_finite(v.y()) && is_finite(v.z());
}
[[nodiscard]] inline bool is_finite(const Mat3d& R) noexcept {
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i)
      if (!is_finite(R(i, j))) return false;
  return true;
}
/// The same for rotation and translation; nothing reads the bottom row of the matrix.
[[nodiscard]] inline bool is_finite(const Posed& X) noexcept {
  return is_finite(Mat3d(X.linear())) && is_finite(Vec3d(X.translation()));
}

/// Largest entry of |RᵀR − I|: 0 for a rotation and for a mirror, infinite if an entry of R is not finite.
[[nodiscard]] inline double rotation_defect(const Mat3d& R) noexcept {
  const Mat3d RtR = product(transposed(R), R);
  double worst = 0;
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double off = std::abs(RtR(i, j) - (i == j ? 1 : 0));
      if (!is_finite(off)) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, off);
    }
  return worst;
}

/// Returns the length of v, or the largest double where its squares overflow.
[[nodiscard]] inline double bounded_norm(const Vec3d& v) noexcept {
  return std::min(std::hypot(v.x(), v.y(), v.z()), std::numeric_limits<double>::max());
}

}  // namespace trephine
