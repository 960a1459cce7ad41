// SPDX-License-Identifier: MIT
// Headers in any order: the stage that cuts is read before the map of depths, whose cut it must find.
#include <trephine/stage/milling.hpp>

#include <trephine/render/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

TickResult mill(VoxelGrid<std::int16_t>& bone, DepthMap& depths) {
  const ToolDiscretization tool{Burr{}, SurfaceCounts::thesis()};
  HapticScene scene{bone, 300, CoupledToolRenderer{tool, FromDepthMap(depths)}, Milling{}};
  return scene.tick({}, 1e-3);
}
