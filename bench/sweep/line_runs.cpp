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
    using Ball = BallGradient;
    t.add<float, TR, ProjectedTracking, TorqueOnly, StoredGradient>(kLineThesis);
    t.add<float, TR, Constrained, FullWrench, Ball>(kLineDefault);
    // The default but for one choice.
    t.add<float, TR, ProjectedTracking, FullWrench, Ball>("translate_rotate-projected-full-ball-refined");
    t.add<float, TR, CentrelineTracking, FullWrench, Ball>("translate_rotate-centreline-full-ball-refined");
    t.add<float, TR, Constrained, FullWrench, Ball>("translate_rotate-constrained-full-ball");
    t.add<float, TR, Constrained, FullWrench, Ball>("translate_rotate-constrained-full-ball-refined-thesis_trigger");
    t.add<float, TR, Constrained, FullWrench, Ball>("translate_rotate-constrained-full-ball-refined-probe_origin");
    t.add<float, TR, Constrained, TorqueOnly, Ball>("translate_rotate-constrained-torque-ball-refined");
    t.add<float, TR, Constrained, FullWrench, AnalyticGradient>("translate_rotate-constrained-full-analytic-refined");
    t.add<float, TR, Constrained, FullWrench, CentralGradient>("translate_rotate-constrained-full-central-refined");
    t.add<float, TR, Constrained, FullWrench, StoredGradient>("translate_rotate-constrained-full-stored-refined");
    t.add<float, RayCast, Constrained, FullWrench, Ball>("ray_cast-constrained-full-ball-refined");
    t.add<double, TR, Constrained, FullWrench, Ball>(kLineDefault);
    return t.runs;
  }();
  return table;
}

const Runs<std::int16_t>& line_runs_16() {
  static const auto table = [] {
    Table<std::int16_t> t;
    t.add<float, TranslateRotate, ConstrainedTracking, FullWrench, AnalyticGradient>(
        "translate_rotate-constrained-full-analytic-refined");
    t.add<float, TranslateRotate, ConstrainedTracking, FullWrench, BallGradient>(kLineDefault);
    return t.runs;
  }();
  return table;
}

}  // namespace trephine::bench
