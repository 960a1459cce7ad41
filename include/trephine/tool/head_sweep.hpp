// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/sag.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/cutter.hpp>

#include <algorithm>

namespace trephine::inline TREPHINE_ALIGNED {

/// How a cutting head is swept from pose to pose:
/// - `travel(head, a, b)`: an upper bound of the motion of its points [m];
/// - `size(head)`: its radius [m], which tells one head from another; `length(head)` along its axis [m];
/// - `cutter<kind>(head, from, to, start_is_cut, spacing)`: the body that a cut of this kind removes.
/// Balls are here; heads of revolution have theirs in revolved_cutter.hpp.
template <class Head>
struct HeadSweep;

/// By how much a head of radius R [m] is larger as it cuts by pressure in voxels of this spacing [m].
///
/// The wall that it leaves sags by a 36th of a squared diagonal over R, as it curves one way. The rest of the allowance
/// is room for contact's offset. The law does not charge it, and in a wide hole a head wanders and cuts yet more. In a
/// narrow one walls on all sides guide it.
[[nodiscard]] inline double pressed_allowance(double allowance, double R, const Vec3d& spacing) noexcept {
  constexpr double kMaxRoom = 0.001;  // of the radius, so a hole's area is too large by a 500th at most
  return std::min(allowance, kMaxRoom * R + sag_square(spacing, 1.0 / 36) / R);
}

template <>
struct HeadSweep<Burr> {
  [[nodiscard]] static double travel(const Burr&, const Posed& a, const Posed& b) noexcept {
    return (b.translation() - a.translation()).norm();
  }
  [[nodiscard]] static double size(const Burr& burr) noexcept { return burr.tip_radius; }
  [[nodiscard]] static double length(const Burr& burr) noexcept { return 2 * burr.tip_radius; }
  template <CutKind>
  [[nodiscard]] static SphereCutter cutter(const Burr& burr, const Posed& from, const Posed& to, bool start_is_cut,
                                           const Vec3d&) noexcept {
    return {from.translation(), to.translation(), burr.tip_radius, start_is_cut};
  }
};

template <>
struct HeadSweep<CuttingBall> : HeadSweep<Burr> {
  template <CutKind kKind>
  [[nodiscard]] static SphereCutter cutter(const CuttingBall& ball, const Posed& from, const Posed& to,
                                           bool start_is_cut, const Vec3d& spacing) noexcept {
    double R = ball.tip_radius;
    if constexpr (kKind == CutKind::kByPressure) {
      R -= ball.allowance;
      R += pressed_allowance(ball.allowance, R, spacing);
    }
    return {from.translation(), to.translation(), R, start_is_cut};
  }
};

}  // namespace trephine
