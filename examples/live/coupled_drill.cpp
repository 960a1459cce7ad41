// SPDX-License-Identifier: MIT
#include "held_drill_of.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>

namespace live {

std::unique_ptr<HeldDrill> coupled_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                         Inboxes& inboxes) {
  const trephine::CoupledOptions gains{
      .stiffness = settings.stiffness, .rotational_stiffness = 0.3, .force = kMaxForce, .torque = kMaxTorque};
  if (const trephine::RevolvedTool* tool = settings.shape())
    return held(bone, isovalue, settings, inboxes, trephine::CoupledToolRenderer{*tool, gains});
  return held(bone, isovalue, settings, inboxes, trephine::CoupledToolRenderer{settings.burr, gains});
}

}  // namespace live
