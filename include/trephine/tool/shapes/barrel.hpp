// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A barrel burr: sides that bulge as an arc between two flat ends. Lengths are in metres.
struct BarrelBurr {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0020;      ///< in the middle, the largest [m]
  double end_radius = 0.0014;  ///< of the ends, were their rims sharp [m], below `radius`
  double length = 0.0050;      ///< of the head [m]; at least twice what the sides bulge
  double rim_radius = 0.0004;  ///< of the rims between sides and ends [m]
  Shank shank{};

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("BarrelBurr", "radius must be > 0 m", radius);
    if (!(end_radius > 0) || !(end_radius < radius))
      refuse("BarrelBurr", "end_radius must be in (0, radius) m", end_radius);
    const double half = length / 2, bulge = radius - end_radius;
    if (!(half >= bulge)) refuse("BarrelBurr", "length must be at least twice radius - end_radius", length);
    if (!(rim_radius > 0) || !(rim_radius < end_radius) || !(rim_radius < half))
      refuse("BarrelBurr", "rim_radius must be in (0, end_radius) m and below length / 2", rim_radius);
    // The sides' arc, and the centres of the rims' arcs inside it.
    const double middle = half - radius, arc = (half * half + bulge * bulge) / (2 * bulge), centre = radius - arc;
    const double up = half - rim_radius, to_rim = arc - rim_radius,
                 flat = centre + std::sqrt(to_rim * to_rim - up * up);
    const double touch = centre + (flat - centre) * arc / to_rim, rise = up * arc / to_rim;
    ToolOutline outline(flat, -radius);
    outline.arc_to(touch, middle - rise, flat, middle - up).arc_to(radius, middle, centre, middle);
    outline.arc_to(touch, middle + rise, centre, middle).arc_to(flat, middle + half, flat, middle + up);
    const double top = shank.append_to(outline);
    return {outline, top};
  }
};

}  // namespace trephine
