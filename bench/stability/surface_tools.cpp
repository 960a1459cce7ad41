// SPDX-License-Identifier: MIT
#include "stability/tool_scene.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

template <class Weights, class Deep = ExtendAlongSurface, class Shaft = FullWrench>
std::unique_ptr<AnyTool> surface(const Setup& setup, Bone& bone, double isovalue) {
  SurfaceOptions options{.stiffness = setup.stiffness};
  options.budget = setup.budget;
  const ToolDiscretization<SurfaceCounts, float> tool(setup.burr, counts_of(setup));
  return wrapped(SurfaceApproxRenderer<float, Weights, Deep, Shaft>(tool, options), setup, bone, isovalue);
}

}  // namespace

std::unique_ptr<AnyTool> make_surface_tool(const Setup& setup, Bone& bone, double isovalue) {
  const std::string& name = setup.options;
  const auto make = name == "default" || name == "thesis' counts" ? surface<PatchWeights>
                    : name == "Eq. 16"                            ? surface<CollisionRatio>
                    : name == "held force"                        ? surface<PatchWeights, HoldForce>
                    : name == "torque without force" ? surface<PatchWeights, ExtendAlongSurface, TorqueOnly>
                    : name == "area weights"         ? surface<AreaWeights>
                    : name == "thesis"               ? surface<CollisionRatio, HoldForce, TorqueOnly>
                                                     : nullptr;
  if (!make) throw std::invalid_argument("make_tool: surface has no options '" + name + "'");
  return make(setup, bone, isovalue);
}

}  // namespace trephine::bench
