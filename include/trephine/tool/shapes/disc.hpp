// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A disc (wheel) burr: a flat cylinder with a round rim, which cuts with it. Lengths are in metres.
struct DiscBurr {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0050;     ///< [m]
  double thickness = 0.0008;  ///< [m], below `radius`; the rim's radius is half of it
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("DiscBurr", "radius must be > 0 m", radius);
    if (!(thickness > 0) || !(thickness < radius)) refuse("DiscBurr", "thickness must be in (0, radius) m", thickness);
    const double rim = thickness / 2, flat = radius - rim;
    ToolOutline outline(flat, -radius);
    outline.arc_to(radius, -radius + rim, flat, -radius + rim).arc_to(flat, -radius + thickness, flat, -radius + rim);
    outline.line_to(shank.first_radius(), -radius + thickness);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
