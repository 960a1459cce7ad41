// SPDX-License-Identifier: MIT
// says: As a type: CoupledToolRenderer<double, tool, friction, motion>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>

using namespace trephine;

CoupledToolRenderer<BallAndShaft> renderer{Burr{}};
