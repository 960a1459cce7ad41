// SPDX-License-Identifier: MIT
#include "held_drill_of.hpp"

#include "../drill/scene.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>

namespace live {

std::unique_ptr<HeldDrill> line_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                      Inboxes& inboxes) {
  using namespace trephine;
  const ToolDiscretization tool{settings.burr, LineCounts{}};
  return held_with(
      bone, isovalue, settings, inboxes, LineApproxRenderer{tool, LineOptions{.stiffness = settings.stiffness}},
      Remote{Cutting{settings.tuning.cut(settings.burr)}, inboxes.feed}, drill::line_release(settings.stiffness));
}

}  // namespace live
