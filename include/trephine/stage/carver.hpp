// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/shape.hpp>

#include <concepts>

namespace trephine::inline TREPHINE_ALIGNED {

/// What a cutting law lets a tick's cuts by pressure take.
struct PressedCut {
  double fraction = 1;  ///< of the bone in the head, 0 to 1
  double way = 0;       ///< by which the head may go ahead [m]
};

/// Inputs of a carver beside the tool's poses.
struct CarveContext {
  bool spindle_on = false;
  double dt = 0;        ///< interval since the last tick [s], within [kShortestDt, kLongestDt]
  double force_N = 0;   ///< magnitude of this tick's raw contact force [N], before any stage: the pressing force
  double fraction = 1;  ///< of the bone in the head that a cut by pressure removes: a cutting law's, if one is listed
};

/// The part of a scene that removes bone. The scene calls it once a tick after contact, on the haptic thread, with the
/// spindle on or off. It lowers densities along the tool's path from `X_GT_previous` to `X_GT`. The two are equal
/// without a path: at the first tick, and after bad input, a jump, a stall longer than kLongestDt or a step faster than
/// kMaxSpeed. It returns the removed volume [mm³], finite and >= 0. Its work must be bounded.
/// `head` is the cutting head of the renderer's tool: its `cutting_head()` if it has one, a `Burr` or a `CuttingHead`,
/// else its `shape()`.
/// A carver that spares or watches structures has `add_to(StructureSummary&) const noexcept` (`StructureReporter`).
///
/// The poses are the renderer's `cutting_pose()`, or its `cutting_pose(dt)` if it has one and the carver cuts at once
/// (`kCutsAtOnce`). A carver that follows the probe, the device's own pose, has a `follow_probe` that converts to true:
/// a member function or a data member, which may be static constexpr.
template <class C, class Grid, class Head = Burr>
concept Carver = requires(C c, Grid& grid, double isovalue, const Posed& X_GT, const Head& head,
                          const CarveContext& context) {
  { c.carve(grid, isovalue, X_GT, X_GT, head, context) }
  noexcept->std::same_as<double>;
};

/// True if the carver removes everything that it covers at once, as a geometric cut does; a static constexpr member
/// `kCutsAtOnce` declares it. A cut in time removes bone by its reach and by the time. A cut at once removes bone by
/// its reach at each tick. So a renderer that moves its cutting pose ahead gives a cut at once a speed
/// (`cutting_pose(dt)`, dt in s), and a cut in time a length.
template <class C>
inline constexpr bool kCutsAtOnce = requires {
  requires C::kCutsAtOnce;
};
/// Shortest time of a cut at once at a speed [s]: at 1 kHz and less each tick cuts, above 1 kHz some do.
inline constexpr double kShortestBite = 1e-3;

/// True if the carver removes a fraction of the bone that presses on the head, as a PressureCut does; a static
/// constexpr member `kCutsUnderPressure` declares it. The scene then cuts at the renderer's `pressure_cutting_pose()`,
/// if it has one.
template <class C>
inline constexpr bool kCutsUnderPressure = requires {
  requires C::kCutsUnderPressure;
};

/// Returns whether the carver cuts at once, or under pressure, in this tick. A carver whose cut is chosen at run time
/// declares what it may do as above, and has a member function `cuts_at_once` or `cuts_under_pressure`.
template <class C>
[[nodiscard]] constexpr bool cuts_at_once(const C& carver) noexcept {
  if constexpr (requires { static_cast<bool>(carver.cuts_at_once()); })
    return static_cast<bool>(carver.cuts_at_once());
  else
    return kCutsAtOnce<C>;
}
template <class C>
[[nodiscard]] constexpr bool cuts_under_pressure(const C& carver) noexcept {
  if constexpr (requires { static_cast<bool>(carver.cuts_under_pressure()); })
    return static_cast<bool>(carver.cuts_under_pressure());
  else
    return kCutsUnderPressure<C>;
}

/// True if the carver follows the probe instead of the cutting pose.
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
