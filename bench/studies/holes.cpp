// SPDX-License-Identifier: MIT
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "support/fields.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>

#include <functional>

namespace trephine::bench {
namespace {

using namespace trephine::test;
using Shape = std::function<double(const Vec3d&)>;

// How deep below the flat face the tool's lowest place comes to rest under `load` pressed straight down [m]; `most` if
// it falls through.
template <class Renderer>
double rest_depth(Renderer renderer, const VoxelGrid<std::uint8_t>& grid, double isovalue, const Vec3d& top,
                  const Mat3d& R, double reach, double load, double most) {
  const DensityField<std::uint8_t, float, typename Renderer::Gradient> field(grid, isovalue);
  renderer.reset();
  constexpr double kStep = 2e-5;
  for (double depth = -0.0005; depth < most; depth += kStep) {
    Pose<float> X = Pose<float>::Identity();
    X.linear() = R.cast<float>();
    X.translation() = (top + Vec3d(0, 0, reach - depth)).cast<float>();
    const auto out = renderer.render(field, X);
    if (out.wrench.force.z() >= load) return depth;
  }
  return most;
}

}  // namespace

/// A burr over a round hole and a shaft over a slot narrower than they are, pressed down with half a newton: who falls
/// in. `ideal`: where rigid geometry would stop it.
void study_holes(const StudyOptions& options) {
  Table table(options.folder + "/holes.csv", "place,width_over_diameter,renderer,rest_depth_mm,ideal_mm,falls_in");
  RasterOptions o{.size = {81, 81, 81}};
  const double load = 0.5, most = 0.004;
  const Vec3d top = o.middle() + Vec3d(0.00011, 0.00007, 0.0051);
  const auto each = [&](const char* place, double share, const Shape& shape, const Burr& burr, const Mat3d& R,
                        double ideal, double reach) {
    const auto grid = rasterise<std::uint8_t>(shape, o);
    const Vec3d at = top - R * Vec3d(0, 0, burr.has_shaft() ? burr.shaft_length / 2 : 0);
    const auto row = [&](const char* name, auto renderer, double lowest) {
      const double depth = rest_depth(renderer, grid, o.isovalue(), at, R, lowest, load, most);
      table.row(place, share, name, 1e3 * depth, 1e3 * ideal, depth >= most ? 1 : 0);
    };
    // Line is pressed with its point or centreline, Surface with its side.
    row("line", LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}}, 0);
    row("surface ratio (thesis)",
        SurfaceApproxRenderer<float, CollisionRatio, HoldForce>{ToolDiscretization{burr, SurfaceCounts::thesis()}},
        reach);
    row("surface area", SurfaceApproxRenderer<float, AreaWeights>{ToolDiscretization{burr, SurfaceCounts::thesis()}},
        reach);
    row("surface patch", SurfaceApproxRenderer<float, PatchWeights>{ToolDiscretization{burr, SurfaceCounts::thesis()}},
        reach);
    row("surface patch (fine)",
        SurfaceApproxRenderer<float, PatchWeights>{
            ToolDiscretization{burr, SurfaceCounts{.sphere = 400, .slices = 80, .per_slice = 16}}},
        reach);
  };
  const HalfSpace face{top, Vec3d::UnitZ()};
  const Burr ball{.shaft_length = 0};
  const Burr drill{};
  for (const double share : {0.3, 0.5, 0.7, 0.8, 0.9}) {
    const double hole = share * ball.tip_radius;
    const double into = ball.tip_radius - std::sqrt(ball.tip_radius * ball.tip_radius - hole * hole);
    each("round hole", share, Both{face, Hollow{Rod{top, Vec3d::UnitZ(), hole}}}, ball, Mat3d::Identity(), into,
         ball.tip_radius);
    const double slot = share * drill.shaft_radius;
    const double sinks = drill.shaft_radius - std::sqrt(drill.shaft_radius * drill.shaft_radius - slot * slot);
    // The shaft lies along y over a slot along y; a short block, so that the ball hangs free beside it.
    const Mat3d lying = rotation_between<double>(Vec3d::UnitZ(), Vec3d::UnitY());
    const Block block{top - Vec3d(0, 0, 0.006), Vec3d(0.006, 0.003, 0.006)};
    each("slot along the shaft", share, Both{block, Hollow{Plate{top, Vec3d::UnitX(), 2 * slot}}}, drill, lying, sinks,
         drill.shaft_radius);
  }
}

}  // namespace trephine::bench
