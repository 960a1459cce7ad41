// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A tapered (fissure) burr: a round end that widens as a cone toward the shank. Lengths are in metres.
struct TaperBurr {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0008;      ///< at the upper rim, the largest [m]
  double end_radius = 0.0004;  ///< of the round end [m], below `radius`
  double length = 0.0060;      ///< of the head [m]; more than two radii
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("TaperBurr", "radius must be > 0 m", radius);
    if (!(end_radius > 0) || !(end_radius < radius))
      refuse("TaperBurr", "end_radius must be in (0, radius) m", end_radius);
    if (!(length > 2 * radius)) refuse("TaperBurr", "length must exceed two radii", length);
    // The ball of the round end, and the height of the rim above its centre.
    const double centre = end_radius - radius, rise = length - end_radius, to_rim = std::hypot(radius, rise);
    const double lean = std::acos(end_radius / to_rim) - std::atan2(rise, radius);  // of the cone's normal, downward
    ToolOutline outline(0, -radius);
    outline.arc_to(end_radius * std::cos(lean), centre - end_radius * std::sin(lean), 0, centre)
        .line_to(radius, centre + rise);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
