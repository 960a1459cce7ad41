// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>

/// Arithmetic of spatial (six-dimensional) vectors and matrices: small motions, wrenches and stiffnesses.
namespace trephine::inline TREPHINE_ALIGNED {

/// Spatial vector: a small motion (δp [m], δθ [rad]) of a body about its origin, or a force [N] above a torque [N·m].
using Vec6d = Eigen::Matrix<double, 6, 1>;
/// Spatial matrix, for instance a stiffness or a Hessian over small motions.
using Mat6d = Eigen::Matrix<double, 6, 6>;

/// Spatial vector of its two parts.
[[nodiscard]] inline Vec6d spatial(const Vec3d& linear, const Vec3d& angular) noexcept {
  Vec6d v;
  for (Eigen::Index i = 0; i < 3; ++i) {
    v[i] = linear[i];
    v[3 + i] = angular[i];
  }
  return v;
}
/// Translation of a small motion [m], or force [N]. Eigen's head and tail take longer to compile.
[[nodiscard]] inline Vec3d linear_part(const Vec6d& v) noexcept { return {v[0], v[1], v[2]}; }
/// Rotation of a small motion [rad], or torque [N·m].
[[nodiscard]] inline Vec3d angular_part(const Vec6d& v) noexcept { return {v[3], v[4], v[5]}; }
/// Sets the rotation, or the torque, to 0.
inline void clear_angular(Vec6d& v) noexcept { v[3] = v[4] = v[5] = 0; }

/// Symmetric matrix with the given lower triangle. Eigen's selfadjointView adds a second of compile time.
[[nodiscard]] inline Mat6d symmetric(Mat6d lower) noexcept {
  for (Eigen::Index j = 0; j < 6; ++j)
    for (Eigen::Index i = 0; i < j; ++i) lower(i, j) = lower(j, i);
  return lower;
}

/// Outer product k v wᵀ. Eigen's product of expressions takes longer to compile.
[[nodiscard]] inline Mat3d outer(double k, const Vec3d& v, const Vec3d& w) noexcept {
  Mat3d m;
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i) m(i, j) = k * v[i] * w[j];
  return m;
}

/// Adds a block to the entries from (row, column) on. Eigen's expression takes longer to compile.
inline void add_block(Mat6d& m, Eigen::Index row, Eigen::Index column, const Mat3d& block) noexcept {
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i) m(row + i, column + j) += block(i, j);
}

/// Adds k to three entries of a diagonal, from (first, first) on.
inline void add_to_diagonal(Mat6d& m, Eigen::Index first, double k) noexcept {
  for (Eigen::Index i = first; i < first + 3; ++i) m(i, i) += k;
}

/// Sets the rows and columns of rotation to 0.
inline void clear_angular(Mat6d& m) noexcept {
  for (Eigen::Index j = 0; j < 6; ++j)
    for (Eigen::Index i = 3; i < 6; ++i) m(i, j) = m(j, i) = 0;
}

/// Pose X after a small motion: translation δp [m] and rotation δθ [rad] about X's origin, in the axes that X maps to.
[[nodiscard]] inline Posed moved(const Posed& X, const Vec6d& motion) noexcept {
  const Mat3d R = X.linear();
  const Vec3d p = X.translation();
  return make_pose<double>(product(rotation_from_vector(angular_part(motion)), R), p + linear_part(motion));
}

/// Turns a motion or a wrench to the axes of another frame.
[[nodiscard]] inline Vec6d rotated(const Mat3d& R, const Vec6d& v) noexcept {
  return spatial(product(R, linear_part(v)), product(R, angular_part(v)));
}
/// Small motion that takes pose a to pose b: the inverse of `moved`.
[[nodiscard]] inline Vec6d motion_to(const Posed& a, const Posed& b) noexcept {
  const Vec3d from = a.translation(), to = b.translation();
  return spatial(to - from, turn_between(a, b));
}

}  // namespace trephine
