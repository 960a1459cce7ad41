// SPDX-License-Identifier: MIT
#include <trephine/render/surface/surface_approx_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {

Outcome drill_surface(const Session& session) {
  using namespace trephine;
  const ToolDiscretization tool{session.bone.burr, SurfaceCounts{}};
  // Its force is quadratic in depth: without a budget the tangent would be up to four times the device's stiffness.
  constexpr double kSoftest = 0.3;  // [N·m/rad] where the device does not tell
  const double able = session.handled.capabilities().angular_stiffness, k = bone_stiffness(session);
  const double angular = (able > 0 ? able : kSoftest) * session.registration.scale();
  return drill_with(SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = k, .budget = StiffnessBudget{k, angular}}},
                    session);
}

}  // namespace openhaptics
