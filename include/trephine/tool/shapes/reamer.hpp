// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A reamer: a long cutting taper with a chamfered front that widens a hole. Lengths are in metres.
struct Reamer {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0040;        ///< at the upper rim, the largest [m]
  double front_radius = 0.0034;  ///< above the chamfer [m], below `radius`
  double chamfer = 0.0015;       ///< of the front, at 45° [m], below `front_radius`
  double length = 0.020;         ///< of the cutting part [m]
  double rim_radius = 0.0004;    ///< of the rounded rims on both sides of the chamfer [m]
  Shank shank{.radius = 0.0030, .length = 0.120};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("Reamer", "radius must be > 0 m", radius);
    if (!(front_radius > 0) || !(front_radius < radius))
      refuse("Reamer", "front_radius must be in (0, radius) m", front_radius);
    if (!(chamfer > 0) || !(chamfer < front_radius))
      refuse("Reamer", "chamfer must be in (0, front_radius) m", chamfer);
    if (!(length > 2 * radius)) refuse("Reamer", "length must exceed two radii", length);
    ToolOutline outline(front_radius - chamfer, -radius);
    outline.line_to(front_radius, chamfer - radius, rim_radius).line_to(radius, length - radius, rim_radius);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
