// SPDX-License-Identifier: MIT
#include <trephine/render/coupled/coupled_tool_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {

Outcome drill_coupled(const Session& session) {
  using trephine::CoupledToolRenderer;
  const trephine::DeviceCapabilities able = session.handled.capabilities();
  // Without motors for torque the virtual tool turns as the handle does.
  const trephine::CoupledOptions options{.stiffness = bone_stiffness(session),
                                         .force = able.max_force,
                                         .torque = able.output_dof < 6 ? 0 : able.max_torque};
  if (session.bone.tool) return drill_with(CoupledToolRenderer{*session.bone.tool, options}, session);
  return drill_with(CoupledToolRenderer{session.bone.burr, options}, session);
}

}  // namespace openhaptics
