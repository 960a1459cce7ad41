// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

#include <trephine/render/thesis/line.hpp>

namespace trephine::bench {
namespace {

template <class Renderer>
std::vector<Row> measure_line(Renderer renderer, const Imaged& imaged, const Setting& s, bool shaft_force) {
  const Scenario& scenario = *imaged.scenario;
  return measure(renderer, imaged, s, !scenario.shaft, [&](const Case& c, const Renderer&) {
    Truth truth;
    truth.wrench.force = kStiffness * c.line_truth.force;
    truth.wrench.torque = kStiffness * c.line_truth.torque;
    if (scenario.shaft && !shaft_force) truth.wrench.force.setZero();
    truth.point = c.line_contact;
    return truth;
  });
}

ToolDiscretization<LineCounts, float> tool_of(const Imaged& imaged, const Setting& s) {
  return {imaged.scenario->burr, {.shaft = s.vertices}};
}

template <class Step>
std::vector<Row> run_line(const Imaged& imaged, const Setting& s) {
  LineOptions options{.stiffness = kStiffness};
  options.proxy.jump = 1;
  return measure_line(LineApproxRenderer<float, Step>(tool_of(imaged, s), options, Step{.stepping = {.step = s.step}}),
                      imaged, s, true);
}

std::vector<Row> run_thesis(const Imaged& imaged, const Setting& s) {
  ThesisLineOptions options{.stiffness = kStiffness};
  options.proxy.jump = 1;
  return measure_line(ThesisLine<float>(tool_of(imaged, s), options), imaged, s, false);
}

}  // namespace

void add_line_runs(Runs& runs) {
  runs[{"line", kLineThesis}] = run_thesis;
  runs[{"line", kLineDefault}] = run_line<TranslateRotate>;
  runs[{"line", kLineRayCast}] = run_line<RayCast>;
}

}  // namespace trephine::bench
