// SPDX-License-Identifier: MIT
// says: write LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}, LineOptions{}
#include <trephine/render/line/line_approx_renderer.hpp>

using namespace trephine;

auto renderer() { return LineApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts{}}}; }
