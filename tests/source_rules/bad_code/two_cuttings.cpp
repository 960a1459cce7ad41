// SPDX-License-Identifier: MIT
// says: more than one Cutting: what cuts in a scene is one part
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

auto scene(VoxelGrid<short>& bone) {
  return HapticScene{bone, 300, CoupledToolRenderer{Burr{}}, Cutting{}, Cutting{AdvancingCut{}}};
}
