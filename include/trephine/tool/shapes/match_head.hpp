// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A match-head burr (acorn): half a ball in front of a cylinder. Lengths are in metres.
struct MatchHead {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0015;  ///< [m]
  double length = 0.0038;  ///< of the head, from the foremost point to the upper rim [m]; at least 1.5 radii
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("MatchHead", "radius must be > 0 m", radius);
    if (!(length >= 1.5 * radius)) refuse("MatchHead", "length must be at least 1.5 radii", length);
    ToolOutline outline(0, -radius);
    outline.arc_to(radius, 0, 0, 0).line_to(radius, length - radius);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
