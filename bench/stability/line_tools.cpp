// SPDX-License-Identifier: MIT
#include "stability/tool_scene.hpp"

#include <trephine/render/thesis/line.hpp>

#include <stdexcept>

namespace trephine::bench {

std::unique_ptr<AnyTool> make_line_tool(const Setup& setup, Bone& bone, double isovalue) {
  const ToolDiscretization<LineCounts, float> tool(setup.burr, LineCounts{});
  if (setup.options == "thesis")
    return wrapped(ThesisLine<float>(tool, {.stiffness = setup.stiffness, .friction = setup.friction}), setup, bone,
                   isovalue);
  if (setup.options != "default") throw std::invalid_argument("make_tool: line has no options '" + setup.options + "'");
  LineOptions options{.stiffness = setup.stiffness};
  options.budget = setup.budget;
  if (setup.friction > 0)
    return wrapped(LineApproxRenderer{tool, options, TranslateRotate{}, Coulomb(setup.friction, setup.friction)}, setup,
                   bone, isovalue);
  return wrapped(LineApproxRenderer{tool, options}, setup, bone, isovalue);
}

}  // namespace trephine::bench
