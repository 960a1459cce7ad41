// SPDX-License-Identifier: MIT
#include <trephine/render/line/line_approx_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {

Outcome drill_line(const Session& session) {
  using namespace trephine;
  const ToolDiscretization tool{session.bone.burr, LineCounts{}};
  return drill_with(LineApproxRenderer{tool, LineOptions{.stiffness = bone_stiffness(session)}}, session);
}

}  // namespace openhaptics
