// SPDX-License-Identifier: MIT
// says: write SurfaceApproxRenderer{ToolDiscretization{burr, SurfaceCounts{}}, SurfaceOptions{}}
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

TickResult first_tick(VoxelGrid<std::int16_t>& bone) {
  auto scene = HapticScene{bone, 300, SurfaceApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}}, DeviceLimits{}};
  return scene.tick({}, 1e-3);
}
