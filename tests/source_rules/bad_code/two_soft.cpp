// SPDX-License-Identifier: MIT
// says: more than one SoftStructures: list one, with all structures
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/structure/soft_structures.hpp>

using namespace trephine;

auto scene(VoxelGrid<short>& bone, SoftStructures& soft) {
  return HapticScene{bone, 300, CoupledToolRenderer{Burr{}}, soft, soft};
}
