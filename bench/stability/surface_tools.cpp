// SPDX-License-Identifier: MIT
#include "stability/tool_scene.hpp"

#include <trephine/render/thesis/surface.hpp>

#include <stdexcept>

namespace trephine::bench {

std::unique_ptr<AnyTool> make_surface_tool(const Setup& setup, Bone& bone, double isovalue) {
  const ToolDiscretization<SurfaceCounts, float> tool(setup.burr, counts_of(setup));
  if (setup.options == "thesis")
    return wrapped(ThesisSurface<float>(tool, {.stiffness = setup.stiffness}), setup, bone, isovalue);
  if (setup.options != "default" && setup.options != "thesis' counts")
    throw std::invalid_argument("make_tool: surface has no options '" + setup.options + "'");
  SurfaceOptions options{.stiffness = setup.stiffness};
  options.budget = setup.budget;
  return wrapped(SurfaceApproxRenderer{tool, options}, setup, bone, isovalue);
}

}  // namespace trephine::bench
