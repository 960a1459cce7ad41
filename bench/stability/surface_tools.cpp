// SPDX-License-Identifier: MIT
#include "stability/scene.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

template <class Weights, class Deep, class Shaft>
std::unique_ptr<AnyTool> surface(const Setup& setup, Bone& bone, double isovalue) {
  SurfaceOptions options{.stiffness = setup.stiffness};
  options.budget = setup.budget;
  const ToolDiscretization<SurfaceCounts, float> tool(setup.burr, counts_of(setup));
  return wrapped(SurfaceApproxRenderer<float, Weights, Deep, Shaft>(tool, options), setup, bone, isovalue);
}

}  // namespace

std::unique_ptr<AnyTool> make_surface_tool(const Setup& setup, Bone& bone, double isovalue) {
  const std::string& name = setup.options;
  if (name == "default" || name == "thesis' counts")
    return surface<PatchWeights, ExtendAlongSurface, FullWrench>(setup, bone, isovalue);
  if (name == "Eq. 16") return surface<CollisionRatio, ExtendAlongSurface, FullWrench>(setup, bone, isovalue);
  if (name == "held force") return surface<PatchWeights, HoldForce, FullWrench>(setup, bone, isovalue);
  if (name == "torque without force")
    return surface<PatchWeights, ExtendAlongSurface, TorqueOnly>(setup, bone, isovalue);
  if (name == "area weights") return surface<AreaWeights, ExtendAlongSurface, FullWrench>(setup, bone, isovalue);
  if (name == "thesis") return surface<CollisionRatio, HoldForce, TorqueOnly>(setup, bone, isovalue);
  throw std::invalid_argument("make_tool: surface has no options '" + name + "'");
}

}  // namespace trephine::bench
