// SPDX-License-Identifier: MIT
// says: a law of cutting belongs into the Cutting
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

auto scene(VoxelGrid<short>& bone) {
  return HapticScene{bone, 300, CoupledToolRenderer{Burr{}}, CuttingForce(CuttingForce::Options{}), Cutting{}};
}
