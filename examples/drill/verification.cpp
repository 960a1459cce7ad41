// SPDX-License-Identifier: MIT
#include "verification.hpp"

#include "bone.hpp"
#include "csv.hpp"
#include "phantom.hpp"
#include "run.hpp"

#include <trephine/render/thesis/line.hpp>
#include <trephine/render/thesis/surface.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/device_limits.hpp>

#include <algorithm>
#include <cstdio>

namespace drill {
namespace {

using namespace trephine;

constexpr Burr kBurr{.tip_radius = 0.003, .shaft_radius = 0.0016, .shaft_length = 0.040};
constexpr double kStiffness = 800;

Grid cube() { return block_phantom<std::int16_t>(60, 4, 0.5e-3); }

/// The middle of the cube's upper face.
Spot top_of(const Grid& grid) {
  const double middle = 0.5 * (grid.size()[0] - 1) * grid.spacing().x();
  return {.p_W = {middle, middle, middle + 30 * grid.spacing().x()}, .normal_W = Vec3d::UnitZ(), .depth = 0.030};
}

/// Nothing between contact and log: no damping, no vibration, no filter.
template <class Renderer>
RunLog lean_on_edge(const std::string& name, const Renderer& renderer, const Surgeon& surgeon, bool real_time) {
  Grid grid = cube();
  auto scene =
      HapticScene{grid, PhantomDensities::kIsovalue, renderer, Cutting{}, DeviceLimits{.force = 8.5, .torque = 0.188}};
  return perform(name, scene, surgeon, surgeon.ends(Surgeon::kHold), real_time, "verification, " + name);
}

double rate_of(const LogRow& r) {
  return std::min(1000.0, 1e9 / static_cast<double>(std::max<std::int64_t>(r.tick_ns, 1)));
}

}  // namespace

Verification run_verification(const Options& options) {
  const Surgeon surgeon(top_of(cube()), kBurr, {.seconds = 6, .hole_depth = 2.6, .lean = 0.36});
  const ToolDiscretization line{kBurr, LineCounts{.shaft = options.line_vertices}};
  const ToolDiscretization surface{kBurr, counts_of(options, SurfaceCounts::thesis())};
  const auto run = [&](const std::string& name, const auto& renderer) {
    return lean_on_edge(name, renderer, surgeon, options.real_time);
  };
  return {run("line", LineApproxRenderer{line, LineOptions{.stiffness = kStiffness}}),
          run("surface", SurfaceApproxRenderer{surface, SurfaceOptions{.stiffness = kStiffness}}),
          run("the thesis' line", ThesisLine{line, ThesisLineOptions{.stiffness = kStiffness}}),
          run("the thesis' surface", ThesisSurface{surface, ThesisSurfaceOptions{.stiffness = kStiffness}}), surgeon};
}

void write_line_csv(const RunLog& log, const std::string& path) {
  Csv csv(path, "time_s,rate_Hz,spring_m,lever_m,reaction_N,torque_Nm");
  for (const LogRow& r : log.rows) csv.row(r.time, rate_of(r), r.spring_m, r.lever_m, r.reaction_N, r.shaft_torque_Nm);
  csv.close();
}

void write_surface_csv(const RunLog& log, const std::string& path) {
  Csv csv(path, "time_s,rate_Hz,slice,lever_m,reaction_N,torque_Nm,total_torque_Nm");
  auto slice = log.slices.begin();
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const LogRow& r = log.rows[i];
    bool any = false;
    for (; slice != log.slices.end() && slice->tick == i; ++slice, any = true)
      csv.row(r.time, rate_of(r), slice->slice, slice->lever_m, slice->reaction_N, slice->torque_Nm, r.shaft_torque_Nm);
    if (!any) csv.row(r.time, rate_of(r), 0, 0.0, 0.0, 0.0, r.shaft_torque_Nm);
  }
  csv.close();
}

std::vector<Finding> as_information(std::vector<Finding> findings) {
  for (Finding& f : findings) f.verdict = Finding::Verdict::kInformation;
  return findings;
}

int print_findings(const std::string& title, const std::vector<Finding>& findings) {
  int failed = 0;
  std::printf("\n%s\n", title.c_str());
  for (const Finding& f : findings) {
    const char* verdict = f.verdict == Finding::Verdict::kPass   ? "pass"
                          : f.verdict == Finding::Verdict::kFail ? "FAIL"
                                                                 : "  - ";
    std::printf("  [%s] %s\n         %s\n", verdict, f.says.c_str(), f.figures.c_str());
    failed += f.verdict == Finding::Verdict::kFail ? 1 : 0;
  }
  return failed;
}

}  // namespace drill
