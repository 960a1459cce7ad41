// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A pear burr: a ball in front that narrows as a cone toward the shank. Lengths are in metres.
struct PearBurr {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0012;      ///< of the ball, the largest [m]
  double length = 0.0040;      ///< of the head, from the foremost point to its upper rim [m]; more than two radii
  double top_radius = 0.0007;  ///< at the upper rim [m], below `radius`
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("PearBurr", "radius must be > 0 m", radius);
    if (!(length > 2 * radius)) refuse("PearBurr", "length must exceed two radii", length);
    if (!(top_radius > 0) || !(top_radius < radius))
      refuse("PearBurr", "top_radius must be in (0, radius) m", top_radius);
    // The cone touches the ball where the ball's normal leans from the horizontal as much as the cone's.
    const double top = length - radius, to_rim = std::hypot(top_radius, top);
    const double lean = std::atan2(top, top_radius) - std::acos(radius / to_rim);
    ToolOutline outline(0, -radius);
    outline.arc_to(radius * std::cos(lean), radius * std::sin(lean), 0, 0).line_to(top_radius, top);
    const double head_top = shank.append_to(outline);
    return {outline, head_top};
  }
};

}  // namespace trephine
