// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A cylindrical (fissure) burr with a flat end and a rounded rim. Lengths are in metres.
struct CylinderBurr {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0008;      ///< [m]
  double length = 0.0045;      ///< of the head [m]; more than `radius`
  double rim_radius = 0.0002;  ///< of the rounded rim of the flat end [m], in (0, radius)
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("CylinderBurr", "radius must be > 0 m", radius);
    if (!(length > radius)) refuse("CylinderBurr", "length must exceed radius", length);
    if (!(rim_radius > 0) || !(rim_radius < radius))
      refuse("CylinderBurr", "rim_radius must be in (0, radius) m", rim_radius);
    ToolOutline outline(radius, -radius);
    outline.line_to(radius, length - radius, rim_radius);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
