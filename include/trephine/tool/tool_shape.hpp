// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/shape.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>

/// Tool shapes: rigid tools given by their exact signed distance, for the coupled tool.
namespace trephine::inline TREPHINE_ALIGNED {

/// Number of points that a tool shape evaluates per call. The fixed count lets compilers vectorise plain loops.
inline constexpr std::size_t kProfileLanes = 16;
template <std::floating_point S>
using ProfileLanes = std::array<S, kProfileLanes>;

/// Signed distances of points to a tool, with gradients and curvatures, in the half plane (ρ, z) of each point. ρ >= 0
/// is the distance from the tool's axis [m]; z is the height along the axis toward the handle [m].
struct Profile {
  ProfileLanes<double> distance;    ///< signed distance, negative inside the tool [m]
  ProfileLanes<double> normal_rho;  ///< ρ component of the distance's gradient, a unit vector
  ProfileLanes<double> normal_z;    ///< its z component
  ProfileLanes<double> curvature;   ///< of the level line through the point, in the half plane [1/m]; 0 on a cylinder
  ProfileLanes<double> central;     ///< 1 if the nearest part is a ball about T's origin (no moments), else 0
};

/// Bound on a tool's motion. A point `arm` [m] from T's origin moves by at most shift + turn · arm relative to the
/// tool's surface. Rotation about the tool's own axis does not count: the surface is one of revolution.
struct ToolMotion {
  double shift = 0;  ///< displacement of T's origin [m]
  double turn = 0;   ///< rotation of the axis [rad]

  /// Largest displacement of a point `arm` [m] from T's origin [m].
  [[nodiscard]] double at(double arm) const noexcept { return shift + turn * arm; }
  [[nodiscard]] bool is_within(const ToolMotion& other) const noexcept {
    return shift <= other.shift && turn <= other.turn;
  }
};
/// Sum of two motions.
[[nodiscard]] inline ToolMotion operator+(const ToolMotion& a, const ToolMotion& b) noexcept {
  return {a.shift + b.shift, a.turn + b.turn};
}
/// Motion from pose a to pose b.
[[nodiscard]] inline ToolMotion motion_between(const Posed& a, const Posed& b) noexcept {
  const Vec3d shift = a.translation() - b.translation(), turn = z_axis(a) - z_axis(b);
  return {shift.norm(), turn.norm()};
}

/// Bounding cylinder of a tool and the radius of its core, in T.
struct ToolBounds {
  double z_low;   ///< lowest z [m]
  double z_high;  ///< highest z [m]
  double radius;  ///< largest ρ [m]
  /// Smallest distance of the surface from the axis [m], apart from this length at either end of the axis.
  double core_radius;
  double head_top;  ///< z at which the cutting head ends [m]

  /// Upper bound on the distance of the tool's points from T's origin [m].
  [[nodiscard]] double arm() const noexcept { return std::max(-z_low, z_high) + radius; }
};

/// A rigid tool: a surface of revolution about T's z axis, given by its exact signed distance. A class with these
/// members is a new tool; no other code changes. Lengths are in metres, in T.
/// - `profile(rho, z, profile)` computes distances, gradients and curvatures of kProfileLanes points;
/// - `distances(rho, z, distances)` computes the distances alone, in single precision;
/// - `bounds()` returns the bounding cylinder; `burr()` a ball and a shaft of its size, for checks and drawing;
/// - `cutting_head(allowance)` returns the part that cuts, enlarged by `allowance` [m]: a `Burr` or a `CuttingHead`.
///
/// Inside a union of bodies the distance may be the smallest of the bodies' distances.
// clang-format off
template <class T>
concept ToolShape = std::copy_constructible<T> &&
    requires(const T& tool, const ProfileLanes<double>& at, const ProfileLanes<float>& in, Profile& profile, ProfileLanes<float>& out) {
  { tool.profile(at, at, profile) } noexcept;
  { tool.distances(in, in, out) } noexcept;
  { tool.bounds() } noexcept -> std::same_as<ToolBounds>;
  { tool.burr() } noexcept -> std::same_as<const Burr&>;
  { tool.cutting_head(double{}) } noexcept;
};
// clang-format on

}  // namespace trephine
