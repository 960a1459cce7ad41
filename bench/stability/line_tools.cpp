// SPDX-License-Identifier: MIT
#include "stability/tool_scene.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

/// kRough: may have friction too.
template <class Track = ConstrainedTracking, class Shaft = FullWrench, class Gradient = SplineGradient,
          bool kRough = false>
std::unique_ptr<AnyTool> line(const Setup& setup, const LineOptions& options, Bone& bone, double isovalue) {
  const ToolDiscretization<LineCounts, float> tool(setup.burr, LineCounts{});
  if constexpr (kRough) {
    using Rough = LineApproxRenderer<float, TranslateRotate, Track, Coulomb, Shaft, Gradient>;
    if (setup.friction > 0)
      return wrapped(Rough(tool, options, {}, Coulomb(setup.friction, setup.friction)), setup, bone, isovalue);
  }
  if (setup.friction > 0) throw std::invalid_argument("make_tool: no friction with '" + setup.options + "'");
  return wrapped(LineApproxRenderer<float, TranslateRotate, Track, Frictionless, Shaft, Gradient>(tool, options), setup,
                 bone, isovalue);
}

}  // namespace

std::unique_ptr<AnyTool> make_line_tool(const Setup& setup, Bone& bone, double isovalue) {
  const std::string& name = setup.options;
  const bool thesis = name == "thesis";
  LineOptions options{.stiffness = setup.stiffness};
  options.budget = setup.budget;
  options.refine = !thesis && name != "most active vertex";
  options.recheck_at_rest = !thesis;
  if (thesis || name == "thesis' trigger") options.proxy.trigger = Trigger::kThesis;
  const auto make = name == "default"                ? line<ConstrainedTracking, FullWrench, SplineGradient, true>
                    : name == "torque without force" ? line<ConstrainedTracking, TorqueOnly>
                    : name == "stored gradient"      ? line<ConstrainedTracking, FullWrench, StoredGradient>
                    : name == "projected tracking"   ? line<ProjectedTracking>
                    : name == "thesis' trigger" || name == "most active vertex" ? line<>
                    : thesis ? line<ProjectedTracking, TorqueOnly, StoredGradient, true>
                             : nullptr;
  if (!make) throw std::invalid_argument("make_tool: line has no options '" + name + "'");
  return make(setup, options, bone, isovalue);
}

}  // namespace trephine::bench
