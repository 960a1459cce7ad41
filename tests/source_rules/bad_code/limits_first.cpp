// SPDX-License-Identifier: MIT
// says: write it at the end of the list
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

const LineApproxRenderer line{ToolDiscretization{Burr{}, LineCounts{}}};

auto scene(VoxelGrid<std::int16_t>& bone) {
  return HapticScene{bone, 300, line, DeviceLimits{.force = 3.3}, Damping{{.linear = 1}}};
}
