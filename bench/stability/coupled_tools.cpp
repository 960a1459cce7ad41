// SPDX-License-Identifier: MIT
#include "stability/scene.hpp"

#include <stdexcept>

namespace trephine::bench {

std::unique_ptr<AnyTool> make_coupled_tool(const Setup& setup, Bone& bone, double isovalue) {
  if (setup.options != "default")
    throw std::invalid_argument("make_tool: coupled has no options '" + setup.options + "'");
  CoupledOptions options = setup.coupled;
  options.stiffness = setup.stiffness;
  if (setup.friction > 0)
    return wrapped(CoupledToolRenderer{setup.burr, options, Coulomb(setup.friction, setup.friction)}, setup, bone,
                   isovalue);
  return wrapped(CoupledToolRenderer{setup.burr, options}, setup, bone, isovalue);
}

}  // namespace trephine::bench
