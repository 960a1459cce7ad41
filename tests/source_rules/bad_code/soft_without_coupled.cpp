// SPDX-License-Identifier: MIT
// says: SoftStructures need a renderer that carries loads
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/structure/soft_structures.hpp>

using namespace trephine;

auto scene(VoxelGrid<short>& bone, SoftStructures& soft) {
  return HapticScene{bone, 300, LineApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}}, soft};
}
