// SPDX-License-Identifier: MIT
// says: name it first
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <utility>

using namespace trephine;

const LineApproxRenderer line{ToolDiscretization{Burr{}, LineCounts{}}};

auto scene(VoxelGrid<std::int16_t> bone) { return HapticScene{std::move(bone), 300, line, Damping{{.linear = 1}}}; }
