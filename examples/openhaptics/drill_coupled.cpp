// SPDX-License-Identifier: MIT
#include <trephine/render/coupled/coupled_tool_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {
namespace {

template <trephine::CoupledMotion Motion>
Outcome drill_moving(const Session& session, const trephine::CoupledOptions& options) {
  using namespace trephine;
  if (session.bone.tool)
    return drill_with(CoupledToolRenderer<double, RevolvedTool, Frictionless, Motion>(*session.bone.tool, options),
                      session);
  return drill_with(CoupledToolRenderer<double, BallAndShaft, Frictionless, Motion>(session.bone.burr, options),
                    session);
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
