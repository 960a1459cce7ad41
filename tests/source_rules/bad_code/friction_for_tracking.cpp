// SPDX-License-Identifier: MIT
// says: LineApproxRenderer<float, stepping, tracking, friction, shaft force, gradient, tool>
#include <trephine/render/line/line_approx_renderer.hpp>

using namespace trephine;

using Drill = LineApproxRenderer<float, TranslateRotate, Coulomb>;
auto renderer() { return Drill{ToolDiscretization{Burr{}, LineCounts{}}}; }
