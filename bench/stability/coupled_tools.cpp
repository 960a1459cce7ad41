// SPDX-License-Identifier: MIT
// The renderers that read depths.
#include "stability/scene.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

ToolDiscretization<SurfaceCounts, float> tool_of(const Setup& setup) {
  if (setup.options != "default")
    throw std::invalid_argument("make_tool: " + setup.renderer + " has no options '" + setup.options + "'");
  return {setup.burr, counts_of(setup)};
}

}  // namespace

std::unique_ptr<AnyTool> make_coupled_tool(const Setup& setup, Bone& bone, double isovalue) {
  const auto tool = tool_of(setup);
  const FromDepthMap depths(bone.depths(isovalue));
  CoupledOptions options = setup.coupled;
  options.stiffness = setup.stiffness;
  if (setup.friction > 0)
    return wrapped(CoupledToolRenderer(tool, depths, options, Coulomb(setup.friction, setup.friction)), setup, bone,
                   isovalue);
  return wrapped(CoupledToolRenderer(tool, depths, options), setup, bone, isovalue);
}

std::unique_ptr<AnyTool> make_energy_tool(const Setup& setup, Bone& bone, double isovalue) {
  const auto tool = tool_of(setup);
  if (setup.friction > 0) throw std::invalid_argument("make_tool: energy has no friction");
  return wrapped(EnergySurfaceRenderer(tool, FromDepthMap(bone.depths(isovalue)), {.stiffness = setup.stiffness}),
                 setup, bone, isovalue);
}

}  // namespace trephine::bench
