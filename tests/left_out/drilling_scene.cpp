// SPDX-License-Identifier: MIT
#include <trephine/everything.hpp>

// Lists what bare_scene.cpp leaves out, so that the check is seen to find it.
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input);
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input) {
  using namespace trephine;
  HapticScene scene{bone, 100, LineApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}}, Cutting{}};
  return scene.tick(input, 1e-3);
}
