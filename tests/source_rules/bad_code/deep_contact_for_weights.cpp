// SPDX-License-Identifier: MIT
// says: SurfaceApproxRenderer<float, weighting, deep contact, shaft force, gradient, tool>
#include <trephine/render/surface/surface_approx_renderer.hpp>

using namespace trephine;

using Drill = SurfaceApproxRenderer<float, HoldForce>;
auto renderer() { return Drill{ToolDiscretization{Burr{}, SurfaceCounts{}}}; }
