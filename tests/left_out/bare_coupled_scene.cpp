// SPDX-License-Identifier: MIT
#include <trephine/everything.hpp>

// As bare_scene.cpp, of another renderer.
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input);
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input) {
  using namespace trephine;
  HapticScene scene{bone, 100, CoupledToolRenderer{Burr{}}};
  return scene.tick(input, 1e-3);
}
