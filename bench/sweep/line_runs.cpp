// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

namespace trephine::bench {
namespace {

template <class Step>
Step stepping(const Setting& s) {
  if constexpr (std::is_same_v<Step, TranslateRotate>)
    return {.translation_steps = s.steps, .rotation_steps = s.steps, .stepping = {.step = s.step}};
  else
    return {.steps = s.steps, .stepping = {.step = s.step}};
}

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

template <class Scalar, class Step, class Track, class Shaft, class Gradient, class Density>
std::vector<Row> run_one(const Imaged<Density>& imaged, const Setting& s) {
  using Renderer = LineApproxRenderer<Scalar, Step, Track, Frictionless, Shaft, Gradient>;
  const Scenario& scenario = *imaged.scenario;
  Renderer renderer(typename Renderer::Tool(scenario.burr, {.shaft = s.vertices}), options(s), stepping<Step>(s));
  return measure(renderer, imaged, s, !scenario.shaft, [&](const Case& c, const Renderer&) {
    Truth truth;
    truth.wrench.force = kStiffness * c.line_truth.force;
    truth.wrench.torque = kStiffness * c.line_truth.torque;
    if (scenario.shaft && !Shaft::kForce) truth.wrench.force.setZero();
    truth.point = c.line_contact;
    return truth;
  });
}

template <class Scalar, class Step, class Track, class Shaft, class Gradient, class Density>
void add(Runs<Density>& runs, const char* variant) {
  runs.template add<Scalar>("line", variant, run_one<Scalar, Step, Track, Shaft, Gradient, Density>);
}

}  // namespace

void add_line_runs(Runs<std::uint8_t>& r, Runs<std::int16_t>& in_16_bit) {
  using TR = TranslateRotate;
  using Constrained = ConstrainedTracking;
  using Spline = SplineGradient;
  add<float, TR, ProjectedTracking, TorqueOnly, StoredGradient>(r, kLineThesis);
  add<float, TR, Constrained, FullWrench, Spline>(r, kLineDefault);
  add<double, TR, Constrained, FullWrench, Spline>(r, kLineDefault);
  // The default but for one choice.
  add<float, TR, ProjectedTracking, FullWrench, Spline>(r, "translate_rotate-projected-full-spline-refined");
  add<float, TR, CentrelineTracking, FullWrench, Spline>(r, "translate_rotate-centreline-full-spline-refined");
  for (const char* variant :
       {"translate_rotate-constrained-full-spline", "translate_rotate-constrained-full-spline-refined-thesis_trigger",
        "translate_rotate-constrained-full-spline-refined-probe_origin"})
    add<float, TR, Constrained, FullWrench, Spline>(r, variant);
  add<float, TR, Constrained, TorqueOnly, Spline>(r, "translate_rotate-constrained-torque-spline-refined");
  constexpr const char* kAnalytic = "translate_rotate-constrained-full-analytic-refined";
  add<float, TR, Constrained, FullWrench, AnalyticGradient>(r, kAnalytic);
  add<float, TR, Constrained, FullWrench, CentralGradient>(r, "translate_rotate-constrained-full-central-refined");
  add<float, TR, Constrained, FullWrench, StoredGradient>(r, "translate_rotate-constrained-full-stored-refined");
  add<float, RayCast, Constrained, FullWrench, Spline>(r, "ray_cast-constrained-full-spline-refined");
  add<float, TR, Constrained, FullWrench, AnalyticGradient>(in_16_bit, kAnalytic);
  add<float, TR, Constrained, FullWrench, Spline>(in_16_bit, kLineDefault);
}

}  // namespace trephine::bench
