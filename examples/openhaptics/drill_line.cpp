// SPDX-License-Identifier: MIT
#include <trephine/render/line/line_approx_renderer.hpp>

#include "drill_with.hpp"

namespace openhaptics {

Outcome drill_line(const Session& session) {
  using namespace trephine;
  const ToolDiscretization tool{session.bone.burr, LineCounts{}};
  const double stiffness = bone_stiffness(session);
  return drill_with(LineApproxRenderer{tool, LineOptions{.stiffness = stiffness}}, session,
                    drill::line_release(stiffness));
}

}  // namespace openhaptics
