// SPDX-License-Identifier: MIT
// says: a PressureCut needs a law
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/voxel/pressure_cut.hpp>

using namespace trephine;

auto scene(VoxelGrid<short>& bone) {
  return HapticScene{bone, 300, CoupledToolRenderer{Burr{}}, Cutting{PressureCut{}}};
}
