// SPDX-License-Identifier: MIT
#include "held_drill_of.hpp"

#include <trephine/render/surface/surface_approx_renderer.hpp>

namespace live {

std::unique_ptr<HeldDrill> surface_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                         Inboxes& inboxes) {
  using namespace trephine;
  const ToolDiscretization tool{settings.burr, SurfaceCounts{}};
  return held(bone, isovalue, settings, inboxes,
              SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = settings.stiffness}});
}

}  // namespace live
