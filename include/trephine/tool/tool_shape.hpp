// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/shape.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>

namespace trephine {

/// Points of a tool's half plane are handled this many at a time, so that plain loops vectorise.
inline constexpr std::size_t kProfileLanes = 16;
template <std::floating_point S>
using ProfileLanes = std::array<S, kProfileLanes>;

/// A tool's surface as points see it, in the half plane (ρ, z) through the point and the tool's axis: ρ >= 0 is the
/// distance from the axis, z runs along it toward the handle [m].
struct Profile {
  ProfileLanes<double> distance;    ///< signed, negative inside [m]
  ProfileLanes<double> normal_rho;  ///< gradient of the distance, a unit vector
  ProfileLanes<double> normal_z;
  ProfileLanes<double> curvature;  ///< of the level line through the point, in the half plane [1/m]: 0 along a cylinder
  ProfileLanes<double> central;    ///< 1 where the nearest part is a ball about T's origin: no moments; else 0
};

/// Bound of a tool's motion: against its surface, a point that is `arm` [m] from T's origin moves by shift + turn · arm
/// at most. Turning about the tool's own axis is no motion.
struct ToolMotion {
  double shift = 0;  ///< of T's origin [m]
  double turn = 0;   ///< of the axis [rad]

  [[nodiscard]] double at(double arm) const noexcept { return shift + turn * arm; }
  [[nodiscard]] bool is_within(const ToolMotion& other) const noexcept {
    return shift <= other.shift && turn <= other.turn;
  }
};
[[nodiscard]] inline ToolMotion motion_between(const Posed& a, const Posed& b) noexcept {
  return {(a.translation() - b.translation()).norm(), (a.linear().col(2) - b.linear().col(2)).norm()};
}

/// The space that a tool takes up at most.
struct ToolBounds {
  double z_low;  ///< lowest and highest z [m]
  double z_high;
  double radius;  ///< largest ρ [m]
  /// Least distance of the tool's surface from the axis, between points this far from the axis' ends [m].
  double core_radius;

  /// No point of the tool is farther than this from T's origin [m].
  [[nodiscard]] double arm() const noexcept { return std::max(-z_low, z_high) + radius; }
};

/// A rigid tool: a surface of revolution about T's z axis, given by its exact signed distance. A new tool is a class
/// that answers these; nothing else changes.
/// - `profile(rho, z, out)`: distances, gradients and curvatures of kProfileLanes points;
/// - `distances(rho, z, out)`: the distances alone, in single precision;
/// - `bounds()`; `burr()`, the ball that cuts and the shaft, for carving and drawing.
/// Metres, in T. Inside a union of bodies the distance may be the lowest of theirs.
// clang-format off
template <class T>
concept ToolShape = std::copy_constructible<T> &&
    requires(const T& tool, const ProfileLanes<double>& at, const ProfileLanes<float>& in, Profile& profile, ProfileLanes<float>& out) {
  { tool.profile(at, at, profile) } noexcept;
  { tool.distances(in, in, out) } noexcept;
  { tool.bounds() } noexcept -> std::same_as<ToolBounds>;
  { tool.burr() } noexcept -> std::same_as<const Burr&>;
};
// clang-format on

/// Square roots of all lanes, by Eigen: std::sqrt may set errno, which keeps loops from being vectorised.
template <std::floating_point S>
void square_roots(ProfileLanes<S>& x) noexcept {
  Eigen::Map<Eigen::Array<S, static_cast<int>(kProfileLanes), 1>> lanes(x.data());
  lanes = lanes.sqrt();
}

}  // namespace trephine
