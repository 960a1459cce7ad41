// SPDX-License-Identifier: MIT
#include <trephine/render/coupled_tool_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {
namespace {

/// Its own function: the map is cut along while the scene drills.
template <trephine::CoupledMotion Motion>
Outcome drill_moving(const Session& session, const trephine::CoupledOptions& options) {
  using namespace trephine;
  using Renderer = CoupledToolRenderer<float, FromDepthMap, Frictionless, Motion>;
  const ToolDiscretization tool{session.bone.burr, SurfaceCounts::thesis()};
  DepthMap depths(session.bone.grid, session.bone.isovalue);
  return drill_with(Renderer(tool, FromDepthMap(depths), options), session);
}

}  // namespace

Outcome drill_coupled(const Session& session) {
  const trephine::DeviceCapabilities able = session.handled.capabilities();
  trephine::CoupledOptions options{.stiffness = bone_stiffness(session), .force = able.max_force};
  // Without motors for torque the virtual tool turns as the handle does.
  if (able.output_dof < 6) return drill_moving<trephine::TranslationOnly>(session, options);
  options.torque = able.max_torque;
  return drill_moving<trephine::SixDof>(session, options);
}

}  // namespace openhaptics
