// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/core/wrench.hpp>

/// Checks of a tick's poses and intervals, and velocities from consecutive poses.
namespace trephine {

/// Fastest motion of a hand-held tool. A faster step counts as a jump: the pose was set. A hand reaches 5 m/s at most,
/// and a wrist some 30 rad/s.
inline constexpr double kMaxSpeed = 20;          // [m/s]
inline constexpr double kMaxAngularSpeed = 100;  // [rad/s]

/// Returns true for a finite pose nearer than kFarthestPosition whose linear part is a rotation within
/// kRotationTolerance (no mirror). The bottom row of the matrix is neither checked nor used anywhere.
[[nodiscard]] inline bool is_usable_pose(const Posed& X) noexcept {
  const Vec3d p = X.translation();
  if (!(p.norm() < kFarthestPosition)) return false;  // NaN, inf and overflow of the norm fail too
  const Mat3d R = X.linear();
  return rotation_defect(R) <= kRotationTolerance && R.determinant() > 0;
}

/// Returns dt [s] clamped to [kShortestDt, kLongestDt]; NaN becomes the shortest interval.
[[nodiscard]] inline double clamped_dt(double dt) noexcept {
  if (!(dt >= kShortestDt)) return kShortestDt;
  return dt <= kLongestDt ? dt : kLongestDt;
}

/// Returns true if a velocity may be computed over the interval dt [s].
[[nodiscard]] inline bool is_usable_dt(double dt) noexcept { return dt >= kShortestDt && dt <= kLongestDt; }

/// Returns X_GT, the tool's pose in the grid. Positions are subtracted first, in double, so a distant grid costs no
/// accuracy.
[[nodiscard]] inline Posed relative_pose(const Posed& X_WG, const Posed& X_WT) noexcept {
  const Mat3d R_GW = inverse_rotation(X_WG), R_WT = X_WT.linear();
  const Vec3d p_GT_W = X_WT.translation() - X_WG.translation();
  return make_pose<double>(product(R_GW, R_WT), product(R_GW, p_GT_W));
}

/// Returns the twist of T [m/s, rad/s] as the backward difference of two poses dt > 0 [s] apart, in their frame's axes.
/// It is half a tick late and as coarse as the encoders: a quantum of 0.055 mm reads as 55 mm/s at 1 kHz.
[[nodiscard]] inline Twist twist_between(const Posed& before, const Posed& now, double dt) noexcept {
  const Vec3d step = now.translation() - before.translation();
  return {step / dt, turn_between(before, now) / dt};
}

/// Returns true if a hand can move the tool that fast.
[[nodiscard]] inline bool is_plausible(const Twist& v) noexcept {
  return v.linear.norm() <= kMaxSpeed && v.angular.norm() <= kMaxAngularSpeed;
}

}  // namespace trephine
