// SPDX-License-Identifier: MIT
// says: it has no friction
#include <trephine/render/surface/surface_approx_renderer.hpp>

using namespace trephine;

auto renderer() {
  return SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts{}}, SurfaceOptions{}, Coulomb{0.3, 0.2}};
}
