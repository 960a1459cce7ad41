// SPDX-License-Identifier: MIT
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "sweep/runs.hpp"
#include "truth/scenario.hpp"

namespace trephine::bench {

/// Ridges of several widths under a shaft whose vertices (Line) or slices (Surface) stand wider and wider apart.
void study_ridge_spacing(const StudyOptions& options) {
  Table table(options.folder + "/ridge_spacing.csv",
              "ridge_radius_mm,renderer,variant,count,spacing_mm,force_error_rel_p95,torque_error_rel_p95,point_error_"
              "voxel_p95,"
              "misses,cases,tick_ns_median");
  for (const char* radius : {"0.3", "0.6", "1.2"}) {
    const int bones = options.quick ? 4 : 8, per_bone = options.quick ? 4 : 16;
    const Scenario scenario = make_scenario(std::string("shaft_ridge:") + radius, bones, per_bone);
    const Bones imaged(scenario, Image());
    const auto add = [&](Setting s, int count) {
      for (const Row& r : run(s, imaged)) {
        if (r.error_kind != "discretisation") continue;
        const double spacing = (scenario.burr.shaft_length - scenario.burr.tip_radius) / count;
        table.row(radius, s.renderer, s.variant, count, 1e3 * spacing, r.force_error_rel_p95, r.torque_error_rel_p95,
                  r.point_error_voxel_p95, r.misses, scenario.cases.size(), r.tick_ns_median);
      }
    };
    for (const int count : {10, 20, 35, 50, 75, 100, 200, 400}) {
      Setting s;
      s.renderer = "line";
      s.vertices = count;
      for (const char* variant : {kLineDefault, "translate_rotate-constrained-full-spline"}) {
        s.variant = variant;
        add(s, count);
      }
    }
    for (const int count : {10, 20, 35, 50, 75, 100, 200}) {
      Setting s;
      s.renderer = "surface";
      s.slices = count;
      s.per_slice = 16;
      for (const char* variant : {kSurfaceArea, kSurfaceDefault}) {
        s.variant = variant;
        add(s, count);
      }
    }
  }
}

}  // namespace trephine::bench
