// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// A round burr: a ball on a neck. Lengths are in metres. `Burr` is the same without a neck, and quicker.
struct RoundBurr {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0015;  ///< of the ball [m], more than the neck's or the shank's
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("RoundBurr", "radius must be > 0 m", radius);
    const double neck = shank.first_radius();
    if (!(neck > 0) || !(neck < radius)) refuse("RoundBurr", "the neck's radius must be in (0, radius) m", neck);
    const double rise = std::sqrt(radius * radius - neck * neck);
    ToolOutline outline(0, -radius);
    outline.arc_to(neck, rise, 0, 0);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
