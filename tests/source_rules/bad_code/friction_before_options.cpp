// SPDX-License-Identifier: MIT
// says: write CoupledToolRenderer{burr, CoupledOptions{}, Coulomb{0.2, 0.15}}
#include <trephine/render/coupled/coupled_tool_renderer.hpp>

using namespace trephine;

auto renderer() { return CoupledToolRenderer{Burr{}, Coulomb{0.2, 0.15}}; }
