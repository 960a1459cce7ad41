// SPDX-License-Identifier: MIT
// says: the third argument must be a renderer
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

auto scene(VoxelGrid<std::int16_t>& bone) {
  return HapticScene{bone, 300, ToolDiscretization{Burr{}, SurfaceCounts{}}};
}
