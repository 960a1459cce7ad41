// SPDX-License-Identifier: MIT
#include "sweep/bones.hpp"

#include <trephine/render/coupled_tool_renderer.hpp>
#include <trephine/render/energy_surface_renderer.hpp>

namespace trephine::bench {
namespace {

/// The map of a bone, made when first asked for and kept while the bone is: making it is no part of a tick.
template <class Density>
DepthMap& map_of(const Imaged<Density>& imaged, std::size_t bone) {
  if (!imaged.maps[bone])
    imaged.maps[bone] = std::make_unique<DepthMap>(imaged.grids[bone], imaged.isovalue,
                                                   DepthOptions{.reach = 10, .keep_original = false});
  return *imaged.maps[bone];
}

template <class Density>
SurfaceCounts counts(const Setting& s, const Imaged<Density>&) {
  return {.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice};
}

// A rigid tip that a spring presses: the spring times the tip's depth, along the normal.
template <class Density>
std::vector<Row> run_coupled(const Imaged<Density>& imaged, const Setting& s) {
  const Scenario& scenario = *imaged.scenario;
  CoupledToolRenderer renderer(ToolDiscretization<SurfaceCounts, float>(scenario.burr, counts(s, imaged)),
                               FromDepthMap(map_of(imaged, 0)),
                               CoupledOptions{.stiffness = kStiffness, .force = 8.5, .torque = 0.188, .jump = 1});
  const auto field = [&](std::size_t bone) { return DepthField<float>(map_of(imaged, bone)); };
  return measure(renderer, imaged, s, !scenario.shaft, field, [&](const Case& c, const auto&) {
    Truth truth;
    truth.exists = !scenario.shaft;
    truth.wrench.force = kStiffness * c.depth * c.surface.normal;
    truth.point = c.surface.point;
    return truth;
  });
}

// Surface's foundation with the depth along the shortest way out; its continuum is known on planes alone: δ/2 of it is
// the secant. Elsewhere only rigid contact tells.
template <class Density>
std::vector<Row> run_energy(const Imaged<Density>& imaged, const Setting& s) {
  const Scenario& scenario = *imaged.scenario;
  EnergySurfaceRenderer renderer(ToolDiscretization<SurfaceCounts, float>(scenario.burr, counts(s, imaged)),
                                 FromDepthMap(map_of(imaged, 0)),
                                 EnergySurfaceOptions{.stiffness = kStiffness, .jump = 1});
  const auto field = [&](std::size_t bone) { return DepthField<float>(map_of(imaged, bone)); };
  const bool plane = scenario.name == "plane";
  const double R = scenario.burr.tip_radius;
  return measure(renderer, imaged, s, false, field, [&](const Case& c, const auto&) {
    Truth truth;
    truth.exists = plane && c.depth < R;
    truth.wrench.force = kStiffness * c.depth * c.depth / (R / 2) * c.surface.normal;
    // Each ring of the cap at its own depth: its centre of pressure lies a third of δ above the deepest place.
    truth.point = c.surface.point - 2 * c.depth / 3 * c.surface.normal;
    return truth;
  });
}

}  // namespace

const Runs<std::uint8_t>& coupled_runs_8() {
  static const Runs<std::uint8_t> runs{{{kCoupledDefault, "float"}, run_coupled<std::uint8_t>},
                                       {{kEnergySurface, "float"}, run_energy<std::uint8_t>}};
  return runs;
}

const Runs<std::int16_t>& coupled_runs_16() {
  static const Runs<std::int16_t> runs{{{kCoupledDefault, "float"}, run_coupled<std::int16_t>},
                                       {{kEnergySurface, "float"}, run_energy<std::int16_t>}};
  return runs;
}

}  // namespace trephine::bench
