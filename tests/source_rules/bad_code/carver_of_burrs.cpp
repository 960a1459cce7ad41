// SPDX-License-Identifier: MIT
// says: a carver takes a Burr, and the renderer's tool has another head: take any head (const auto&) in carve
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/tool/shapes/match_head.hpp>

using namespace trephine;

struct Ball {
  double carve(VoxelGrid<short>&, double, const Posed&, const Posed&, const Burr&, const CarveContext&) noexcept {
    return 0;
  }
};

TickResult once(VoxelGrid<short>& bone) {
  HapticScene scene{bone, 300, CoupledToolRenderer{MatchHead{}}, Ball{}};
  return scene.tick({}, 1e-3);
}
