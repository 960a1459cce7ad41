// SPDX-License-Identifier: MIT
#include <trephine/everything.hpp>

// A scene of a renderer and nothing else, from the header that has everything: what it does not list must leave no
// symbol in the object file.
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input);
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input) {
  using namespace trephine;
  HapticScene scene{bone, 100, SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts::thesis()}}};
  return scene.tick(input, 1e-3);
}
