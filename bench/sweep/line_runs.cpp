// SPDX-License-Identifier: MIT
#include "sweep/bones.hpp"

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

template <class Density>
struct Table {
  Runs<Density> runs;
  template <class Scalar, class Step, class Track, class Shaft, class Gradient>
  void add(const std::string& name) {
    runs[{name, std::is_same_v<Scalar, float> ? "float" : "double"}] =
        run_one<Scalar, Step, Track, Shaft, Gradient, Density>;
  }
};

}  // namespace

const Runs<std::uint8_t>& line_runs_8() {
  static const auto table = [] {
    using TR = TranslateRotate;
    using Constrained = ConstrainedTracking;
    Table<std::uint8_t> t;
    using Spline = SplineGradient;
    t.add<float, TR, ProjectedTracking, TorqueOnly, StoredGradient>(kLineThesis);
    t.add<float, TR, Constrained, FullWrench, Spline>(kLineDefault);
    // The default but for one choice.
    t.add<float, TR, ProjectedTracking, FullWrench, Spline>("translate_rotate-projected-full-spline-refined");
    t.add<float, TR, CentrelineTracking, FullWrench, Spline>("translate_rotate-centreline-full-spline-refined");
    t.add<float, TR, Constrained, FullWrench, Spline>("translate_rotate-constrained-full-spline");
    t.add<float, TR, Constrained, FullWrench, Spline>(
        "translate_rotate-constrained-full-spline-refined-thesis_trigger");
    t.add<float, TR, Constrained, FullWrench, Spline>("translate_rotate-constrained-full-spline-refined-probe_origin");
    t.add<float, TR, Constrained, TorqueOnly, Spline>("translate_rotate-constrained-torque-spline-refined");
    t.add<float, TR, Constrained, FullWrench, AnalyticGradient>("translate_rotate-constrained-full-analytic-refined");
    t.add<float, TR, Constrained, FullWrench, CentralGradient>("translate_rotate-constrained-full-central-refined");
    t.add<float, TR, Constrained, FullWrench, StoredGradient>("translate_rotate-constrained-full-stored-refined");
    t.add<float, RayCast, Constrained, FullWrench, Spline>("ray_cast-constrained-full-spline-refined");
    t.add<double, TR, Constrained, FullWrench, Spline>(kLineDefault);
    return t.runs;
  }();
  return table;
}

const Runs<std::int16_t>& line_runs_16() {
  static const auto table = [] {
    Table<std::int16_t> t;
    t.add<float, TranslateRotate, ConstrainedTracking, FullWrench, AnalyticGradient>(
        "translate_rotate-constrained-full-analytic-refined");
    t.add<float, TranslateRotate, ConstrainedTracking, FullWrench, SplineGradient>(kLineDefault);
    return t.runs;
  }();
  return table;
}

}  // namespace trephine::bench
