// SPDX-License-Identifier: MIT
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "support/fields.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>

namespace trephine::bench {

/// Force of each law pressed straight into a plane, to three radii deep: mean and spread over directions.
void study_force_depth(const StudyOptions& options) {
  using namespace trephine::test;
  Table table(options.folder + "/force_depth.csv",
              "law,depth_over_R,force_N_mean,force_N_least,force_N_most,direction_deg_max");
  const Burr ball{.shaft_length = 0};
  const double R = ball.tip_radius;
  const int directions = options.quick ? 8 : 40;
  RasterOptions o{.size = {65, 65, 65}};
  Random random(5);
  struct Bone {
    Vec3d top, n;
    VoxelGrid<std::uint8_t> grid;
  };
  std::vector<Bone> bones;
  for (int i = 0; i < directions; ++i) {
    const Vec3d n = random.unit();
    const Vec3d top = o.middle() + 0.003 * n;
    bones.push_back({top, n, rasterise<std::uint8_t>(HalfSpace{top, n}, o)});
  }
  const auto measure = [&](const char* name, auto renderer, bool point) {
    using Renderer = decltype(renderer);
    for (int k = 0; k <= 60; ++k) {
      const double depth = 0.05 * k * R;
      double mean = 0, least = 1e9, most = 0, off = 0;
      for (const Bone& b : bones) {
        const DensityField<std::uint8_t, float, typename Renderer::Gradient> field(b.grid, o.isovalue());
        renderer.reset();
        Rendered<float> out;
        for (int i = 0; i <= 20 + k; ++i) {
          Pose<float> X = Pose<float>::Identity();
          const double above = (point ? 0 : R) + 0.0003 - (depth + 0.0003) * i / (20 + k);
          X.translation() = (b.top + above * b.n).cast<float>();
          out = renderer.render(field, X);
        }
        const Vec3d f = out.wrench.force.template cast<double>();
        mean += f.norm() / directions;
        least = std::min(least, f.norm());
        most = std::max(most, f.norm());
        if (f.norm() > 0.05) off = std::max(off, angle_deg(f, b.n));
      }
      table.row(name, 0.05 * k, mean, least, most, off);
    }
  };
  const ToolDiscretization tool{ball, SurfaceCounts::thesis()};
  measure("line", LineApproxRenderer{ToolDiscretization{ball, LineCounts{}}}, true);
  measure("ratio hold (thesis)", SurfaceApproxRenderer<float, CollisionRatio, HoldForce>{tool}, false);
  measure("ratio extend", SurfaceApproxRenderer<float, CollisionRatio>{tool}, false);
  measure("mean extend", SurfaceApproxRenderer<float, MeanWeights>{tool}, false);
  measure("area extend", SurfaceApproxRenderer<float, AreaWeights>{tool}, false);
  measure("patch extend", SurfaceApproxRenderer<float, PatchWeights>{tool}, false);
}

}  // namespace trephine::bench
