// SPDX-License-Identifier: MIT
#include "held_drill_of.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>

namespace live {

std::unique_ptr<HeldDrill> line_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                      Inboxes& inboxes) {
  using namespace trephine;
  const ToolDiscretization tool{settings.burr, LineCounts{}};
  return held(bone, isovalue, settings, inboxes,
              LineApproxRenderer{tool, LineOptions{.stiffness = settings.stiffness}});
}

}  // namespace live
