// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/shape.hpp>

#include <concepts>

namespace trephine {

/// What a carver may know beside the burr's poses.
struct CarveContext {
  bool spindle_on = false;
  double dt = 0;       ///< interval since the last tick [s], within [kShortestDt, kLongestDt]
  double force_N = 0;  ///< magnitude of this tick's raw contact force [N], before any stage: the pressing force
};

/// The part of a scene that removes bone. It is called once a tick after contact was found, with the spindle on or off
/// (the carver decides), on the haptic thread, and lowers densities along the burr's way from `X_GT_previous` to
/// `X_GT`. The two are equal where there is no way to follow: first tick, after bad input, a jump, a stall longer than
/// kLongestDt, or a step faster than kMaxSpeed. Returns the removed volume [mm³], finite and >= 0. Its work must be
/// bounded.
///
/// The poses are the renderer's `cutting_pose()`, or its `cutting_pose(dt)` where it has that and the carver cuts at
/// once (`kCutsAtOnce`). A carver that wants the probe, the device's own pose, says so by
/// `follow_probe`: a member function or a data member (may be static constexpr) that converts to bool.
template <class C, class Grid>
concept Carver = requires(C c, Grid& grid, double isovalue, const Posed& X_GT, const Burr& burr,
                          const CarveContext& context) {
  { c.carve(grid, isovalue, X_GT, X_GT, burr, context) }
  noexcept->std::same_as<double>;
};

/// Whether this carver takes at once all that it covers, as a geometric cut does: it says so by a static constexpr
/// member `kCutsAtOnce`. A cut in time removes by how far it reaches into the bone and for how long; a cut at once
/// removes by how far it reaches at each tick, so a renderer that pushes its cutting pose ahead gives it a speed
/// (`cutting_pose(dt)`, dt in s), and the other a length.
template <class C>
inline constexpr bool kCutsAtOnce = requires {
  requires C::kCutsAtOnce;
};

/// Whether this carver follows the probe instead of the cutting pose.
template <class C>
[[nodiscard]] constexpr bool follows_probe(const C& carver) noexcept {
  if constexpr (requires { static_cast<bool>(carver.follow_probe()); })
    return static_cast<bool>(carver.follow_probe());
  else if constexpr (requires { static_cast<bool>(carver.follow_probe); })
    return static_cast<bool>(carver.follow_probe);
  else
    return false;
}

}  // namespace trephine
