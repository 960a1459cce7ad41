// SPDX-License-Identifier: MIT
// says: write SurfaceApproxRenderer{ToolDiscretization{burr, SurfaceCounts{}}, SurfaceOptions{}}
#include <trephine/render/surface/surface_approx_renderer.hpp>

using namespace trephine;

auto renderer() { return SurfaceApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}, SurfaceOptions{}}; }
