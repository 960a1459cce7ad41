// SPDX-License-Identifier: MIT
#include "algorithms.hpp"

#include "run.hpp"
#include "scene.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/tool/revolved_vertices.hpp>

namespace drill {
namespace {

using namespace trephine;

template <class Renderer, class... More>
auto simulated_scene(Grid& bone, const Bone& about, const Renderer& renderer, const More&... more) {
  return scene_of(bone, about, renderer, DeviceLimits{.force = kMaxForce, .torque = kMaxTorque}, more...);
}

/// Runs an algorithm with the bone's tool, or else with its burr.
template <class Run>
RunLog with_tool(const Bone& about, const Run& run) {
  return about.tool ? run(*about.tool) : run(about.burr);
}

}  // namespace

RunLog run_line(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon, double pictured) {
  return with_tool(about, [&](const auto& shape) {
    const ToolDiscretization tool{shape, LineCounts{.shaft = options.line_vertices}};
    auto scene = simulated_scene(bone, about, LineApproxRenderer{tool, LineOptions{.stiffness = kStiffness}},
                                 line_release(kStiffness));
    return perform("line", scene, surgeon, pictured, options.real_time, "line");
  });
}

RunLog run_surface(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon, double pictured) {
  return with_tool(about, [&](const auto& shape) {
    const ToolDiscretization tool{shape, counts_of(options, SurfaceCounts{})};
    auto scene = simulated_scene(bone, about, SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = kStiffness}});
    return perform("surface", scene, surgeon, pictured, options.real_time, "surface");
  });
}

RunLog run_coupled(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon, double pictured) {
  const CoupledOptions gains{
      .stiffness = kStiffness, .rotational_stiffness = 0.3, .force = kMaxForce, .torque = kMaxTorque};
  return with_tool(about, [&](const auto& tool) {
    auto scene = simulated_scene(bone, about, CoupledToolRenderer{tool, gains});
    return perform("coupled", scene, surgeon, pictured, options.real_time, "coupled");
  });
}

}  // namespace drill
