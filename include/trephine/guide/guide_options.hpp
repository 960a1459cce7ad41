// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace trephine::inline TREPHINE_ALIGNED {

namespace detail {

/// Share of a law that keeps its largest stiffness within a budget's.
[[nodiscard]] inline double share_within(double budget, double stiffness) noexcept {
  return stiffness > budget ? budget / stiffness : 1.0;
}

// Checks of options, which take no memory unless they refuse: options change on the haptic thread.
inline void check_at_least_zero(std::string_view type, const char* name, const char* unit, double v) {
  if (!(v >= 0) || !is_finite(v)) refuse(type, std::string(name) + " must be finite and >= 0 " + unit, v);
}
inline void check_above_zero(std::string_view type, const char* name, const char* unit, double v) {
  if (!(v > 0)) refuse(type, std::string(name) + " must be > 0 " + unit, v);
}
/// Throws std::invalid_argument unless the ramp is long enough: 50 ms changes the wrench by 3 % a tick at 1 kHz.
inline void check_ramp(std::string_view type, double ramp) {
  constexpr double kShortestRamp = 0.05;
  if (!(ramp >= kShortestRamp) || !is_finite(ramp)) refuse(type, "ramp must be finite and >= 0.05 s", ramp);
}
inline void check_line(std::string_view type, const Vec3d& point_G, const Vec3d& axis_G) {
  constexpr double kShortestAxis = 1e-6;
  if (!(point_G.norm() <= kFarthestPosition))
    refuse(type, "point_G must lie within 1 km of the origin", point_G.norm());
  if (!(axis_G.norm() >= kShortestAxis) || !is_finite(axis_G.norm()))
    refuse(type, "axis_G must be finite and no zero vector", axis_G.norm());
}

}  // namespace detail

/// Options of an `AxisGuide`.
struct AxisGuideOptions {
  Vec3d point_G = Vec3d::Zero();   ///< a point of the line [m]
  Vec3d axis_G = Vec3d::UnitZ();   ///< direction of the line out of the bone, as T's +z; any length above 0
  double stiffness = 400;          ///< k [N/m], >= 0
  double angular_stiffness = 0.2;  ///< k_θ [N·m/rad], >= 0
  double force = 2;                ///< greatest force of spring and damping together [N], >= 0
  double torque = 0.05;            ///< greatest torque of both [N·m], >= 0
  double damping = 0;              ///< across the line [N·s/m], >= 0
  double angular_damping = 0;      ///< of the tilt [N·m·s/rad], >= 0
  double capture_radius = std::numeric_limits<double>::infinity();  ///< [m], > 0; infinite: acts at any distance
  double capture_angle = std::numeric_limits<double>::infinity();   ///< [rad], > 0; infinite: acts at any angle
  bool enabled = true;
  double ramp = 0.5;                        ///< time of the gain from 0 to 1 [s], >= 0.05
  std::optional<StiffnessBudget> budget{};  ///< of this guide

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    detail::check_line(kType, point_G, axis_G);
    detail::check_at_least_zero(kType, "stiffness", "N/m", stiffness);
    detail::check_at_least_zero(kType, "angular_stiffness", "N·m/rad", angular_stiffness);
    detail::check_at_least_zero(kType, "force", "N", force);
    detail::check_at_least_zero(kType, "torque", "N·m", torque);
    detail::check_at_least_zero(kType, "damping", "N·s/m", damping);
    detail::check_at_least_zero(kType, "angular_damping", "N·m·s/rad", angular_damping);
    detail::check_above_zero(kType, "capture_radius", "m", capture_radius);
    detail::check_above_zero(kType, "capture_angle", "rad", capture_angle);
    detail::check_ramp(kType, ramp);
    if (budget) budget->validate();
    if (is_finite(capture_radius) && !(stiffness > 0 && force > 0))
      refuse(kType, "a capture radius needs a stiffness and a force > 0", stiffness);
    if (is_finite(capture_angle) && !(angular_stiffness > 0 && torque > 0))
      refuse(kType, "a capture angle needs an angular stiffness and a torque > 0", angular_stiffness);
  }
  /// Returns the options that keep to their budget.
  [[nodiscard]] AxisGuideOptions within_budget() const noexcept {
    AxisGuideOptions o = *this;
    if (!budget) return o;
    const double linear = detail::share_within(budget->linear, stiffness);
    o.stiffness *= linear, o.force *= linear, o.damping *= linear;
    const double angular = detail::share_within(budget->angular, angular_stiffness);
    o.angular_stiffness *= angular, o.torque *= angular, o.angular_damping *= angular;
    return o;
  }
  /// Returns true if the other options give the same wrench at a gain of 1.
  [[nodiscard]] bool has_law_of(const AxisGuideOptions& o) const noexcept {
    return point_G == o.point_G && axis_G == o.axis_G && stiffness == o.stiffness &&
           angular_stiffness == o.angular_stiffness && force == o.force && torque == o.torque && damping == o.damping &&
           angular_damping == o.angular_damping && capture_radius == o.capture_radius &&
           capture_angle == o.capture_angle;
  }
  static constexpr const char* kType = "AxisGuide";
};

/// Options of a `DepthStop`.
struct DepthStopOptions {
  Vec3d point_G = Vec3d::Zero();  ///< where the axis meets the plane [m]
  Vec3d axis_G = Vec3d::UnitZ();  ///< direction of the push, out of the bone; any length above 0
  double reach = 0;               ///< of the tool beyond T's origin [m], >= 0: the tip's radius
  double stiffness = 800;         ///< k [N/m], >= 0
  double force = 3;               ///< greatest force of spring and damping together [N], >= 0
  double damping = 0;             ///< along the force [N·s/m], >= 0; in full from force/stiffness beyond the stop on
  double capture_radius = std::numeric_limits<double>::infinity();  ///< about the axis [m], > 0; infinite: a plane
  bool enabled = true;
  double ramp = 0.5;                        ///< time of the gain from 0 to 1 [s], >= 0.05
  std::optional<StiffnessBudget> budget{};  ///< of this guide

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    detail::check_line(kType, point_G, axis_G);
    detail::check_at_least_zero(kType, "reach", "m", reach);
    refuse_beyond(kType, "reach", kLongestShaft, reach);
    detail::check_at_least_zero(kType, "stiffness", "N/m", stiffness);
    detail::check_at_least_zero(kType, "force", "N", force);
    detail::check_at_least_zero(kType, "damping", "N·s/m", damping);
    detail::check_above_zero(kType, "capture_radius", "m", capture_radius);
    detail::check_ramp(kType, ramp);
    if (budget) budget->validate();
  }
  /// Returns the options that keep to their budget.
  [[nodiscard]] DepthStopOptions within_budget() const noexcept {
    DepthStopOptions o = *this;
    const double share = budget ? detail::share_within(budget->linear, stiffness) : 1.0;
    o.stiffness *= share, o.force *= share, o.damping *= share;
    return o;
  }
  /// Returns true if the other options give the same wrench at a gain of 1.
  [[nodiscard]] bool has_law_of(const DepthStopOptions& o) const noexcept {
    return point_G == o.point_G && axis_G == o.axis_G && reach == o.reach && stiffness == o.stiffness &&
           force == o.force && damping == o.damping && capture_radius == o.capture_radius;
  }
  static constexpr const char* kType = "DepthStop";
};

}  // namespace trephine
