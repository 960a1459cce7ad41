// SPDX-License-Identifier: MIT
// says: As a type: CoupledToolRenderer<tool, friction>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>

using namespace trephine;

CoupledToolRenderer<float, BallAndShaft> renderer{Burr{}};
