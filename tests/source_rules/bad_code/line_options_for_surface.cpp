// SPDX-License-Identifier: MIT
// says: write SurfaceApproxRenderer{
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>

using namespace trephine;

auto renderer() { return SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts{}}, LineOptions{}}; }
