// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

namespace trephine {

/// A small motion (δp, δθ) of a body about its origin, or a force and a torque about it, as six numbers.
using Vec6d = Eigen::Matrix<double, 6, 1>;
using Mat6d = Eigen::Matrix<double, 6, 6>;

/// The moment of a vector at an arm, below the vector: how a point's motion depends on the body's.
[[nodiscard]] inline Vec6d with_moment(const Vec3d& v, const Vec3d& arm) noexcept {
  Vec6d out;
  out << v, arm.cross(v);
  return out;
}

/// Adds k v vᵀ to the lower triangle of H.
inline void add_square(Mat6d& H, double k, const Vec6d& v) noexcept {
  for (Eigen::Index j = 0; j < 6; ++j) {
    const double kv = k * v[j];
    for (Eigen::Index i = j; i < 6; ++i) H(i, j) += kv * v[i];
  }
}

/// The symmetric matrix of a lower triangle. Eigen's view of one takes a compiler a second.
[[nodiscard]] inline Mat6d symmetric(Mat6d lower) noexcept {
  for (Eigen::Index j = 0; j < 6; ++j)
    for (Eigen::Index i = 0; i < j; ++i) lower(i, j) = lower(j, i);
  return lower;
}

/// k v wᵀ. Eigen's product of expressions takes a compiler longer.
[[nodiscard]] inline Mat3d outer(double k, const Vec3d& v, const Vec3d& w) noexcept {
  Mat3d m;
  for (Eigen::Index j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < 3; ++i) m(i, j) = k * v[i] * w[j];
  return m;
}

/// The pose after a small motion, its rotation about the origin, in the axes of the frame that X is in.
[[nodiscard]] inline Posed moved(const Posed& X, const Vec6d& motion) noexcept {
  const Vec3d turn = motion.tail<3>();
  return make_pose<double>(rotation_from_vector(turn) * X.linear(), X.translation() + motion.head<3>());
}

}  // namespace trephine
