// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/shape.hpp>

#include <concepts>

namespace trephine {

/// A tool's surface as a point sees it, in the half plane (ρ, z) through the point and the tool's axis: ρ >= 0 is the
/// distance from the axis, z runs along it toward the handle [m].
struct ProfilePoint {
  double distance;    ///< signed, negative inside [m]
  double normal_rho;  ///< gradient of the distance, a unit vector
  double normal_z;
  double curvature;  ///< of the level line through the point, in the half plane [1/m]: 0 along a cylinder
  bool central;      ///< the nearest part is of a ball about T's origin: forces there have no moment
};

/// The space that a tool takes up at most.
struct ToolBounds {
  double z_low;        ///< lowest and highest z [m]
  double z_high;
  double radius;       ///< largest ρ [m]
  double core_radius;  ///< every point of the tool's surface is at least this far from the axis' part inside [m]
};

/// A rigid tool: a surface of revolution about T's z axis, given by its exact signed distance. A new tool is a class
/// that answers these; nothing else changes.
/// - `at(rho, z)`: distance, its gradient and its curvature at a point;
/// - `distances(rho, z, out, n)`: the distances of n points at once in single or double precision, n a multiple of 16;
/// - `bounds()`; `burr()`, the ball that cuts and the shaft, for carving and drawing.
/// Metres, in T. Inside a union of bodies the distance may be that of the nearest body: a bound from below of |d|.
// clang-format off
template <class T>
concept ToolShape = std::copy_constructible<T> &&
    requires(const T& tool, double rho, double z, const float* in, float* out, const double* in2, double* out2) {
  { tool.at(rho, z) } noexcept -> std::same_as<ProfilePoint>;
  { tool.distances(in, in, out, std::size_t{16}) } noexcept;
  { tool.distances(in2, in2, out2, std::size_t{16}) } noexcept;
  { tool.bounds() } noexcept -> std::same_as<ToolBounds>;
  { tool.burr() } noexcept -> std::same_as<const Burr&>;
};
// clang-format on

}  // namespace trephine
