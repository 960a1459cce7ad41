// SPDX-License-Identifier: MIT
// says: pass a VoxelGrid that is not const
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

const LineApproxRenderer line{ToolDiscretization{Burr{}, LineCounts{}}};

auto scene(const VoxelGrid<std::int16_t>& bone) { return HapticScene{bone, 300, line, Damping{{.linear = 1}}}; }
