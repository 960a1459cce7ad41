// SPDX-License-Identifier: MIT
#include <trephine/render/surface_approx_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {

Outcome drill_surface(const Session& session) {
  using namespace trephine;
  const ToolDiscretization tool{session.bone.burr, SurfaceCounts{}};
  return drill_with(SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = bone_stiffness(session)}}, session);
}

}  // namespace openhaptics
