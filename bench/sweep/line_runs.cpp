// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

namespace trephine::bench {
namespace {

// Options that are numbers, named in the variant.
[[nodiscard]] LineOptions options(const Setting& s) {
  const auto has = [&](const char* word) { return s.variant.find(word) != std::string::npos; };
  LineOptions o{.stiffness = kStiffness};
  o.proxy.jump = 1;
  if (has("thesis_trigger")) o.proxy.trigger = Trigger::kThesis;
  if (has("probe_origin")) o.torque_origin = TorqueOrigin::kProbe;
  o.refine = has("refined");
  return o;
}

template <class Step, class Track, class Shaft, class Gradient>
std::vector<Row> run_one(const Imaged& imaged, const Setting& s) {
  using Renderer = LineApproxRenderer<float, Step, Track, Frictionless, Shaft, Gradient>;
  const Scenario& scenario = *imaged.scenario;
  Renderer renderer(typename Renderer::Tool(scenario.burr, {.shaft = s.vertices}), options(s),
                    Step{.stepping = {.step = s.step}});
  return measure(renderer, imaged, s, !scenario.shaft, [&](const Case& c, const Renderer&) {
    Truth truth;
    truth.wrench.force = kStiffness * c.line_truth.force;
    truth.wrench.torque = kStiffness * c.line_truth.torque;
    if (scenario.shaft && !Shaft::kForce) truth.wrench.force.setZero();
    truth.point = c.line_contact;
    return truth;
  });
}

}  // namespace

void add_line_runs(Runs& runs) {
  using TR = TranslateRotate;
  using Constrained = ConstrainedTracking;
  using Spline = SplineGradient;
  const auto add = [&](const std::string& variant, Run run) { runs[{"line", variant}] = run; };
  add(kLineThesis, run_one<TR, ProjectedTracking, TorqueOnly, StoredGradient>);
  add(kLineDefault, run_one<TR, Constrained, FullWrench, Spline>);
  // The default but for one choice.
  add("translate_rotate-projected-full-spline-refined", run_one<TR, ProjectedTracking, FullWrench, Spline>);
  add("translate_rotate-centreline-full-spline-refined", run_one<TR, CentrelineTracking, FullWrench, Spline>);
  add("translate_rotate-constrained-full-spline", run_one<TR, Constrained, FullWrench, Spline>);
  for (const char* option : {"-thesis_trigger", "-probe_origin"})
    add(kLineDefault + std::string(option), run_one<TR, Constrained, FullWrench, Spline>);
  add("translate_rotate-constrained-torque-spline-refined", run_one<TR, Constrained, TorqueOnly, Spline>);
  add("translate_rotate-constrained-full-analytic-refined", run_one<TR, Constrained, FullWrench, AnalyticGradient>);
  add("translate_rotate-constrained-full-central-refined", run_one<TR, Constrained, FullWrench, CentralGradient>);
  add("translate_rotate-constrained-full-stored-refined", run_one<TR, Constrained, FullWrench, StoredGradient>);
  add("ray_cast-constrained-full-spline-refined", run_one<RayCast, Constrained, FullWrench, Spline>);
}

}  // namespace trephine::bench
