// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

#include <numbers>

namespace trephine::inline TREPHINE_ALIGNED {

/// A twist drill: a cone that cuts, in front of flutes that guide it and carry chips, and as wide as its hole. Lengths
/// are in metres.
struct TwistDrill {
  using Tool = RevolvedTool;  ///< that it becomes

  double radius = 0.0016;                             ///< [m]
  double point_angle = 118 * std::numbers::pi / 180;  ///< full angle of the cone [rad], 60° to 170°
  double length = 0.060;                              ///< from T's origin to the chuck [m]
  double tip_radius = 0.0003;  ///< of the round tip, as blunt as a chisel edge [m], below `radius`
  double rim_radius = 0.0003;  ///< of the rim between cone and flutes [m]
  double margin = 0.0002;      ///< height of flute above the cone that still cuts [m]

  /// Throws std::invalid_argument.
  operator RevolvedTool() const {  // NOLINT(google-explicit-constructor): these measures are a tool
    if (!(radius > 0)) refuse("TwistDrill", "radius must be > 0 m", radius);
    if (!(point_angle >= std::numbers::pi / 3) || !(point_angle <= 17 * std::numbers::pi / 18))
      refuse("TwistDrill", "point_angle must be pi/3 to 17 pi/18 rad (60 to 170 degrees)", point_angle);
    if (!(margin > 0)) refuse("TwistDrill", "margin must be > 0 m", margin);
    if (!(tip_radius > 0) || !(tip_radius < radius))
      refuse("TwistDrill", "tip_radius must be in (0, radius) m", tip_radius);
    // Where the round tip meets the cone, and the cone the flutes.
    const double half = point_angle / 2, rho = tip_radius * std::cos(half);
    const double z = tip_radius - radius - tip_radius * std::sin(half), shoulder = z + (radius - rho) / std::tan(half);
    if (!(length > shoulder + margin) || !(length > radius))
      refuse("TwistDrill", "length must exceed the cone's and the radius", length);
    ToolOutline outline(0, -radius);
    outline.arc_to(rho, z, 0, tip_radius - radius)
        .line_to(radius, shoulder)
        .line_to(radius, length, rim_radius)
        .close();
    return {outline, shoulder + margin};
  }
};

}  // namespace trephine
