// SPDX-License-Identifier: MIT
#include "algorithms.hpp"

#include "run.hpp"

#include <trephine/render/coupled_tool_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/stage/milling_vibration.hpp>

namespace drill {
namespace {

using namespace trephine;

/// Bone gives way at a rate, not at once: the hand feels it, and a burr that is fed too fast lags behind. The densest
/// voxels let the burr down by its radius in about 1.5 s. Not by force: Line's tip is a point, feels nothing once it
/// has fallen into a pit, and would leave the pit's walls standing.
RateLimitedCut<> bite(const Bone& bone) {
  const double voxels = bone.burr.tip_radius / bone.grid.spacing().minCoeff();
  return {.rate = (bone.grid.original_range().max - bone.isovalue) * voxels / 1.5};
}

/// Of the simulated device [N, N·m].
constexpr double kMostForce = 8.5, kMostTorque = 0.188;

/// The scene of this program: only the renderer differs.
template <class Renderer>
auto scene_of(Grid& bone, const Bone& about, const Renderer& renderer) {
  return HapticScene{bone,
                     about.isovalue,
                     renderer,
                     Milling{bite(about)},
                     MillingVibration{{.frequency = 180, .per_force = 0.08}},
                     Damping{{.linear = 1, .angular = 1e-4, .only_in_contact = true}},
                     DeviceLimits{.force = kMostForce, .torque = kMostTorque}};
}

SurfaceCounts counts_of(const Options& options) {
  return {.sphere = options.sphere_vertices, .slices = options.slices, .per_slice = options.per_slice};
}

}  // namespace

RunLog run_line(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon, double pictured) {
  const ToolDiscretization tool{about.burr, LineCounts{.shaft = options.line_vertices}};
  auto scene = scene_of(bone, about, LineApproxRenderer{tool, LineOptions{.stiffness = kStiffness}});
  return perform("line", scene, surgeon, pictured, options.real_time, "line");
}

RunLog run_surface(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon, double pictured) {
  const ToolDiscretization tool{about.burr, counts_of(options)};
  auto scene = scene_of(bone, about, SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = kStiffness}});
  return perform("surface", scene, surgeon, pictured, options.real_time, "surface");
}

RunLog run_coupled(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon, double pictured) {
  const ToolDiscretization tool{about.burr, counts_of(options)};
  DepthMap depths(bone, about.isovalue);
  const CoupledOptions gains{
      .stiffness = kStiffness, .rotational_stiffness = 0.3, .force = kMostForce, .torque = kMostTorque};
  auto scene = scene_of(bone, about, CoupledToolRenderer{tool, FromDepthMap(depths), gains});
  return perform("coupled", scene, surgeon, pictured, options.real_time, "coupled");
}

}  // namespace drill
