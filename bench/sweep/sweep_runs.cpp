// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>

#include <stdexcept>

namespace trephine::bench {
namespace {

/// The surface of a bone, made when first asked for and kept while the bone is: making it is no part of a tick.
BoneSurfaceView<std::uint8_t> surface_of(const Imaged& imaged, std::size_t bone) {
  auto& surface = imaged.surfaces[bone];
  if (!surface) surface = shared_bone_surface(imaged.grids[bone], imaged.isovalue);
  return surface->view();
}

// A rigid tip that a spring presses: the spring times the tip's depth, along the normal.
std::vector<Row> run_coupled(const Imaged& imaged, const Setting& s) {
  const Scenario& scenario = *imaged.scenario;
  CoupledToolRenderer renderer{scenario.burr,
                               CoupledOptions{.stiffness = kStiffness, .force = 8.5, .torque = 0.188, .jump = 1}};
  const auto field = [&](std::size_t bone) { return surface_of(imaged, bone); };
  renderer.prepare(field(0));
  return measure(renderer, imaged, s, !scenario.shaft, field, [&](const Case& c, const auto&) {
    Truth truth;
    truth.exists = !scenario.shaft;
    truth.wrench.force = kStiffness * c.depth * c.surface.normal;
    truth.point = c.surface.point;
    return truth;
  });
}

const Runs& all_runs() {
  static const Runs all = [] {
    Runs runs;
    add_line_runs(runs);
    add_surface_runs(runs);
    runs[{"coupled", kCoupledDefault}] = run_coupled;
    return runs;
  }();
  return all;
}

}  // namespace

Bones::Bones(const Scenario& scenario, const Image& image)
    : data_(std::make_unique<Data>(Data{make_image(scenario, image)})) {}
Bones::~Bones() = default;

std::vector<std::string> variants(const std::string& renderer) {
  std::vector<std::string> names;
  for (const auto& [key, run] : all_runs())
    if (key.first == renderer) names.push_back(key.second);
  return names;
}

std::vector<Row> run(const Setting& s, const Bones& bones) {
  const auto found = all_runs().find({s.renderer, s.variant});
  if (found == all_runs().end()) throw std::invalid_argument("no " + s.renderer + " variant " + s.variant);
  return found->second(bones.data().imaged, s);
}

}  // namespace trephine::bench
