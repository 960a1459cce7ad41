// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/tool/cutting_head.hpp>
#include <trephine/tool/revolved_cutter.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Shape of a drill's end; a round drill has it at both ends.
enum class DrillEnd : unsigned char { kFlat, kCone, kRound };

/// A drill bit: a cylinder about T's z axis, from its cutting end to `length` behind T's origin. The foremost point of
/// every end is one radius ahead of T's origin, as with the ball of a burr.
struct DrillBit {
  using Cutter = RevolvedCutter;  ///< the body that it removes

  double radius = 0.001;
  double length = 0.010;  ///< of the cutting flutes, from T's origin toward the handle
  DrillEnd end = DrillEnd::kCone;
  double half_angle = 1.0297;  ///< of the cone, from the axis [rad], in (0, π/2); 59° as twist drills have

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(radius > 0) || !is_finite(radius)) refuse("DrillBit", "radius must be > 0 m", radius);
    if (!(length > 0) || !is_finite(length)) refuse("DrillBit", "length must be > 0 m", length);
    refuse_beyond("DrillBit", "radius", kLargestRadius, radius);
    refuse_beyond("DrillBit", "length", kLongestShaft, length);
    if (end == DrillEnd::kRound && !(length > radius))
      refuse("DrillBit", "a round bit's length must exceed its radius", length);
    if (end != DrillEnd::kCone) return;
    if (!(half_angle > 0) || !(half_angle < 1.5707963))
      refuse("DrillBit", "half_angle must be in (0, pi/2) rad", half_angle);
    if (!(shoulder() < length)) refuse("DrillBit", "length must exceed the cone's", length);
  }

  /// The bit, all of which cuts.
  operator CuttingHead() const { return cutting_head(); }  // NOLINT(google-explicit-constructor): it is a head
  [[nodiscard]] CuttingHead cutting_head() const {
    validate();
    ToolOutline outline(end == DrillEnd::kFlat ? radius : 0, -radius);
    if (end == DrillEnd::kRound)
      outline.arc_to(radius, 0, 0, 0).line_to(radius, length - radius).arc_to(0, length, 0, length - radius);
    else
      outline.line_to(radius, shoulder()).line_to(radius, length);
    return {outline.close(), 0};
  }

  /// z of T at which the end has reached the full radius [m].
  [[nodiscard]] double shoulder() const noexcept {
    if (end == DrillEnd::kRound) return 0;
    return end == DrillEnd::kFlat ? -radius : -radius + radius / std::tan(half_angle);
  }
};

}  // namespace trephine
