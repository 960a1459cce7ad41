// SPDX-License-Identifier: MIT
// says: a scene has one renderer
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/haptic_scene.hpp>

using namespace trephine;

const LineApproxRenderer line{ToolDiscretization{Burr{}, LineCounts{}}};

auto scene(VoxelGrid<std::int16_t>& bone) { return HapticScene{bone, 300, line, line}; }
