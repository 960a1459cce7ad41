// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/cutting_head.hpp>
#include <trephine/tool/outline.hpp>
#include <trephine/tool/revolved_cutter.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// Shank of a tool: a neck above the head, then the shank proper. Lengths are in metres. The default is the shank of
/// 2.35 mm that handpieces hold (ISO 1797).
struct Shank {
  double radius = 0.001175;  ///< [m]
  double length = 0.040;     ///< from T's origin to the handle's end [m]
  double neck_radius = 0;    ///< [m]; 0: no neck
  double neck_length = 0;    ///< of the neck above the head [m]

  [[nodiscard]] bool has_neck() const noexcept { return neck_radius > 0 && neck_length > 0; }
  /// Radius of the part next to the head [m].
  [[nodiscard]] double first_radius() const noexcept { return has_neck() ? neck_radius : radius; }

  /// Appends a shoulder of 45°, the neck and the shank to an outline that ends at a head's upper rim, and closes it.
  /// Returns the head's upper end [m]: a shoulder that narrows belongs to the head, and one that widens to the shank.
  /// Throws std::invalid_argument.
  double append_to(ToolOutline& outline) const {
    if (!(radius > 0)) refuse("Shank", "radius must be > 0 m", radius);
    if (!(neck_radius >= 0)) refuse("Shank", "neck_radius must be >= 0 m", neck_radius);
    if (!(neck_length >= 0)) refuse("Shank", "neck_length must be >= 0 m", neck_length);
    const double first = first_radius();
    const double rim = outline.z_high(), narrows = outline.rho_high() - first;
    double z = rim + std::abs(narrows);
    const double head_top = narrows > 0 ? z : rim;
    if (has_neck()) {
      outline.line_to(first, z).line_to(first, z + neck_length);
      z += neck_length + std::abs(radius - neck_radius);
    }
    if (!(length > z)) refuse("Shank", "length must exceed the head's and the neck's, which end above it, got", length);
    outline.line_to(radius, z).line_to(radius, length).close();
    return head_top;
  }
};

/// A rigid tool given by its outline: a `ToolShape`. The part below the height `head_top` cuts.
/// T's origin lies on the axis, one largest radius of the head above the foremost point, as the centre of a burr's
/// ball. Shapes in `tool/shapes/` convert to it; any other outline makes one too.
class RevolvedTool {
 public:
  using Cutter = RevolvedCutter;  ///< the body that its head removes

  /// Throws std::invalid_argument for an outline that is not closed, whose head is empty, or whose foremost point is
  /// not one radius of the head below T's origin.
  RevolvedTool(const ToolOutline& outline, double head_top)
      : outline_(outline), head_(checked(outline, head_top).below(head_top)) {
    const double R = head_.largest_radius();
    if (!(std::abs(outline.z_low() + R) <= kOriginTolerance * R))
      refuse("RevolvedTool", "the foremost point must be at z = -(the head's largest radius) m", outline.z_low());
    burr_ = {.tip_radius = R,
             .shaft_radius = outline.radius_at((head_top + outline.z_high()) / 2),
             .shaft_length = outline.z_high()};
    if (!(burr_.shaft_length > R)) burr_.shaft_length = 0;
    guide_ = outline.widest_to(head_top) - head_top;
    bounds_ = {outline.z_low(), outline.z_high(), outline.largest_radius(), core_radius(), head_top};
  }

  [[nodiscard]] const ToolOutline& outline() const noexcept { return outline_; }
  [[nodiscard]] ToolBounds bounds() const noexcept { return bounds_; }
  /// A ball of the head's largest radius with the shank's radius, for checks of size and simple pictures.
  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  [[nodiscard]] CuttingHead cutting_head(double allowance) const noexcept { return {head_, allowance, guide_}; }

  void profile(const ProfileLanes<double>& rho, const ProfileLanes<double>& z, Profile& out) const noexcept {
    outline_.profile(rho, z, out);
  }
  void distances(const ProfileLanes<float>& rho, const ProfileLanes<float>& z,
                 ProfileLanes<float>& out) const noexcept {
    outline_.distances(rho, z, out);
  }

 private:
  static constexpr double kOriginTolerance = 1e-6;  // rounding of an outline's measures, relative

  [[nodiscard]] static const ToolOutline& checked(const ToolOutline& outline, double head_top) {
    if (!outline.is_closed()) refuse("RevolvedTool", "the outline must be closed, which ends at z", outline.z_high());
    if (!(head_top > outline.z_low()) || !(head_top <= outline.z_high()))
      refuse("RevolvedTool", "head_top must lie on the outline [m]", head_top);
    return outline;
  }

  /// The largest c for which no surface is nearer than c to the axis farther than c from its ends.
  [[nodiscard]] double core_radius() const noexcept {
    double lo = 0, hi = std::min(outline_.largest_radius(), (outline_.z_high() - outline_.z_low()) / 2);
    for (int i = 0; i < kBisections; ++i) {
      const double c = (lo + hi) / 2;
      (outline_.smallest_radius(outline_.z_low() + c, outline_.z_high() - c) >= c ? lo : hi) = c;
    }
    return lo;
  }
  static constexpr int kBisections = 50;  // to the last digit

  ToolOutline outline_, head_;
  double guide_ = 0;
  Burr burr_;
  ToolBounds bounds_;
};

static_assert(ToolShape<RevolvedTool>);

}  // namespace trephine
