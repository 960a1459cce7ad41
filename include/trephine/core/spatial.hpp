// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>

/// Arithmetic of spatial (six-dimensional) vectors and matrices: small motions, wrenches and stiffnesses.
namespace trephine {

/// Spatial vector: a small motion (δp [m], δθ [rad]) of a body about its origin, or a force [N] above a torque [N·m].
using Vec6d = Eigen::Matrix<double, 6, 1>;
/// Spatial matrix, for instance a stiffness or a Hessian over small motions.
using Mat6d = Eigen::Matrix<double, 6, 6>;

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

/// Adds k to three entries of a diagonal, from (first, first) on. Eigen's expression takes longer to compile.
inline void add_to_diagonal(Mat6d& m, Eigen::Index first, double k) noexcept {
  for (Eigen::Index i = first; i < first + 3; ++i) m(i, i) += k;
}

/// Sets the rows and columns of rotation to 0.
inline void clear_rotation(Mat6d& m) noexcept {
  for (Eigen::Index j = 0; j < 6; ++j)
    for (Eigen::Index i = 3; i < 6; ++i) m(i, j) = m(j, i) = 0;
}

/// Pose X after a small motion: translation δp [m] and rotation δθ [rad] about X's origin, in the axes that X maps to.
[[nodiscard]] inline Posed moved(const Posed& X, const Vec6d& motion) noexcept {
  const Vec3d shift = motion.head<3>(), turn = motion.tail<3>();
  const Mat3d R = X.linear();
  return make_pose<double>(rotation_from_vector(turn) * R, X.translation() + shift);
}

/// Small motion that takes pose a to pose b: the inverse of `moved`.
[[nodiscard]] inline Vec6d motion_to(const Posed& a, const Posed& b) noexcept {
  Vec6d motion;
  motion.head<3>() = b.translation() - a.translation();
  motion.tail<3>() = turn_between(a, b);
  return motion;
}

}  // namespace trephine
