// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/patch.hpp>
#include <trephine/tool/surface_discretization.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

/// The Surface approximation's force law on a plane (thesis Eq. 15–17; ours). It is an elastic (Winkler) foundation,
/// F = k Σ w_i a_i d_i with k in N/m³: vertex i stands for a patch of area w_i, whose penetration is a_i along the unit
/// vector d_i. In the continuum F = k π R δ². Integrated over patches (`PatchQuadrature`), not sampled at vertices, a
/// vertex enters contact as gradually as its patch.
namespace trephine::inline TREPHINE_ALIGNED {

/// Force divided by k of group g pressed `depth` [m] into a half space with outward unit normal n (in T), its centre
/// outside. It is the sum over the group's actual vertices, in T axes. `tool` is a ToolDiscretization<SurfaceCounts>.
template <class Tool>
[[nodiscard]] Vec3d plane_law(const Tool& tool, std::size_t g, double depth, const Vec3d& n) {
  const auto& group = tool.groups()[g];
  Vec3d sum = Vec3d::Zero();
  for (int i = group.first; i < group.first + group.count; ++i) {
    const Vec3d d = tool.inward()[i].template cast<double>();
    const double vertex_depth =
        depth - (static_cast<double>(group.radius) - static_cast<double>(tool.radius(i)) * d.dot(n));
    const PatchSpring<double> spring =
        tool.patch(i).template cast<double>().spring(vertex_depth, n, d, tool.along(i).template cast<double>());
    if (spring.length > 0)
      sum += (static_cast<double>(tool.areas()[static_cast<std::size_t>(i)]) * spring.length) * spring.direction;
  }
  return sum;
}

/// Normal component of `plane_law` at `depth` radii, averaged over the plane's directions (for a slice, directions
/// perpendicular to the shaft). The average makes a stated stiffness independent of the tool's orientation. A tip that
/// is no ball faces forward alone: its plane is across the axis.
template <class Tool>
[[nodiscard]] double mean_plane_force(const Tool& tool, std::size_t g, double depth) {
  const double at = depth * static_cast<double>(tool.groups()[g].radius);
  if (g == 0 && !tool.has_ball()) return plane_law(tool, g, at, Vec3d::UnitZ()).z();
  constexpr int kDirections = 720;  // of the average; every half degree round a slice
  const SphereLayout sphere = spread_over_sphere(kDirections);
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Vec3d n =
        g == 0 ? sphere.directions[static_cast<std::size_t>(i)] : Vec3d(std::cos(angle), std::sin(angle), 0);
    sum += plane_law(tool, g, at, n).dot(n);
  }
  return sum / kDirections;
}

/// Tangent stiffness [N/m] of the ball pressed on a plane with `force` [N], for a law of literal stiffness k. The depth
/// is limited to a radius. A force of 0 gives the stiffness at half a radius.
template <class Tool>
[[nodiscard]] double plane_tangent(const Tool& tool, double k, double force) {
  constexpr double kDifference = 0.05;  // half step of the central difference, in radii; exact for a quadratic law
  double low = force > 0 ? 0 : 0.5, high = force > 0 ? 1 : 0.5;
  constexpr int kBisections = 10;  // a depth within a thousandth of a radius
  for (int i = 0; i < kBisections && low < high; ++i) {
    const double middle = (low + high) / 2;
    (k * mean_plane_force(tool, 0, middle) < force ? low : high) = middle;
  }
  const double from = std::max((low + high) / 2 - kDifference, 0.0), to = std::min((low + high) / 2 + kDifference, 1.0);
  const double rise = mean_plane_force(tool, 0, to) - mean_plane_force(tool, 0, from);
  return k * rise / ((to - from) * tool.burr().tip_radius);
}

}  // namespace trephine
