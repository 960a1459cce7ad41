// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/core/wrench.hpp>

#include <algorithm>

/// Checks of a tick's poses and intervals, and velocities from consecutive poses.
namespace trephine::inline TREPHINE_ALIGNED {

/// Fastest motion of a tool in a hand at work. A faster step counts as a jump: its wrench is ramped, and nothing is
/// cut. Hands that drill reach a tenth of it.
inline constexpr double kHandSpeed = 1;  // [m/s]
inline constexpr double kHandTurn = 30;  // [rad/s]
/// Shortest time over which such a speed is judged [s]. In shorter ticks an encoder's single step would be a jump.
inline constexpr double kJumpTime = 1e-3;
/// Relative rounding of a step at just that speed.
inline constexpr double kJumpRounding = 1e-6;
/// Fastest motion whose velocity stages may use. A hand that is flung through the air reaches 5 m/s, a wrist 30 rad/s.
inline constexpr double kMaxSpeed = 20;          // [m/s]
inline constexpr double kMaxAngularSpeed = 100;  // [rad/s]

/// Returns true for a finite pose nearer than kFarthestPosition whose linear part is a rotation within
/// kRotationTolerance (no mirror). The bottom row of the matrix is neither checked nor used anywhere.
[[nodiscard]] inline bool is_usable_pose(const Posed& X) noexcept {
  if (!is_finite(X)) return false;
  const Vec3d p = X.translation();
  if (!(p.norm() < kFarthestPosition)) return false;
  const Mat3d R = X.linear();
  return rotation_defect(R) <= kRotationTolerance && R.determinant() > 0;
}

/// Returns dt [s] clamped to [kShortestDt, kLongestDt]; NaN becomes the shortest interval.
[[nodiscard]] inline double clamped_dt(double dt) noexcept {
  if (is_nan(dt) || dt < kShortestDt) return kShortestDt;
  return dt <= kLongestDt ? dt : kLongestDt;
}

/// Returns true if a velocity may be computed over the interval dt [s].
[[nodiscard]] inline bool is_usable_dt(double dt) noexcept {
  return is_finite(dt) && dt >= kShortestDt && dt <= kLongestDt;
}

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

/// Returns true if no hand moves a tool from one pose to the other in `dt` [s]: the tool, or the bone, was set
/// elsewhere.
[[nodiscard]] inline bool is_jump(const Posed& before, const Posed& now, double dt) noexcept {
  const double time = (1 + kJumpRounding) * std::max(dt, kJumpTime);
  const Vec3d shift = now.translation() - before.translation();
  const Mat3d turn = now.linear() - before.linear();
  // A rotation by φ changes its matrix by 8 sin²(φ/2), and so by 2 φ² at most.
  const double most_turn = kHandTurn * time;
  return !(shift.squaredNorm() <= kHandSpeed * time * (kHandSpeed * time) &&
           turn.squaredNorm() <= 2 * most_turn * most_turn);
}

/// Returns true if velocities that fast make sense.
[[nodiscard]] inline bool is_plausible(const Twist& v) noexcept {
  return v.linear.norm() <= kMaxSpeed && v.angular.norm() <= kMaxAngularSpeed;
}

}  // namespace trephine
