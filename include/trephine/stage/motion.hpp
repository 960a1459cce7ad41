// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/core/wrench.hpp>

#include <cmath>

/// Poses and intervals as a tick receives them: what is usable, and what two poses in a row say about velocity.
namespace trephine {

/// Faster than this the pose was set, not moved: a hand reaches 5 m/s at most, and a wrist some 30 rad/s.
inline constexpr double kFastestSpeed = 20;  // [m/s]
inline constexpr double kFastestTurn = 100;  // [rad/s]

/// True for a finite pose nearer than kFarthestPosition whose linear part is a rotation within kRotationTolerance (no
/// mirror). The bottom row of the matrix is not looked at, nor used anywhere.
[[nodiscard]] inline bool is_usable_pose(const Posed& X) noexcept {
  const Vec3d p = X.translation();
  if (!(p.norm() < kFarthestPosition)) return false;  // NaN, inf and overflow of the norm fail too
  const Mat3d R = X.linear();
  const Mat3d off = R.transpose() * R - Mat3d::Identity();
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(off(i, j)) <= kRotationTolerance)) return false;
  return R.determinant() > 0;
}

/// dt [s] in [kShortestDt, kLongestDt]; NaN becomes the shortest, so that time all but stands still.
[[nodiscard]] inline double clamped_dt(double dt) noexcept {
  if (!(dt >= kShortestDt)) return kShortestDt;
  return dt <= kLongestDt ? dt : kLongestDt;
}

/// Whether dt is an interval that a velocity may be computed from.
[[nodiscard]] inline bool is_usable_dt(double dt) noexcept { return dt >= kShortestDt && dt <= kLongestDt; }

/// X_GT of a tool in a grid. The positions are subtracted first, in double: where the grid stands costs no accuracy.
[[nodiscard]] inline Posed relative_pose(const Posed& X_WG, const Posed& X_WT) noexcept {
  const Mat3d R_GW = inverse_rotation(X_WG);
  const Vec3d p_GT_W = X_WT.translation() - X_WG.translation();
  return make_pose<double>(R_GW * X_WT.linear(), R_GW * p_GT_W);
}

/// Backward difference of two poses of T, dt > 0 apart, in the axes of the frame they are given in. Half a tick late,
/// and as coarse as the encoders: a quantum of 0.055 mm reads as 55 mm/s at 1 kHz.
[[nodiscard]] inline Twist twist_between(const Posed& before, const Posed& now, double dt) noexcept {
  const Vec3d step = now.translation() - before.translation();
  return {step / dt, turn_between(before, now) / dt};
}

[[nodiscard]] inline bool is_plausible(const Twist& v) noexcept {
  return v.linear.norm() <= kFastestSpeed && v.angular.norm() <= kFastestTurn;
}

}  // namespace trephine
