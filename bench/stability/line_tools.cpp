// SPDX-License-Identifier: MIT
#include "stability/scene.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

/// kRough: may have friction too.
template <class Track, class Shaft, class Gradient, bool kRough = false>
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
  LineOptions options{.stiffness = setup.stiffness};
  options.budget = setup.budget;
  const std::string& name = setup.options;
  if (name == "default")
    return line<ConstrainedTracking, FullWrench, SplineGradient, true>(setup, options, bone, isovalue);
  if (name == "torque without force")
    return line<ConstrainedTracking, TorqueOnly, SplineGradient>(setup, options, bone, isovalue);
  if (name == "stored gradient")
    return line<ConstrainedTracking, FullWrench, StoredGradient>(setup, options, bone, isovalue);
  if (name == "projected tracking")
    return line<ProjectedTracking, FullWrench, SplineGradient>(setup, options, bone, isovalue);
  if (name == "thesis' trigger") {
    options.proxy.trigger = Trigger::kThesis;
    return line<ConstrainedTracking, FullWrench, SplineGradient>(setup, options, bone, isovalue);
  }
  if (name == "most active vertex") {
    options.refine = false;  // no look between vertices
    return line<ConstrainedTracking, FullWrench, SplineGradient>(setup, options, bone, isovalue);
  }
  if (name != "thesis") throw std::invalid_argument("make_tool: line has no options '" + name + "'");
  options.proxy.trigger = Trigger::kThesis;
  options.recheck_at_rest = false;
  options.refine = false;
  return line<ProjectedTracking, TorqueOnly, StoredGradient, true>(setup, options, bone, isovalue);
}

}  // namespace trephine::bench
