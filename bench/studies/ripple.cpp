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

constexpr double kVoxel = 3e-4;
const Burr kBall{.shaft_length = 0};

// Force along the normal while a tool slides at constant depth: its rms about a straight line in time, and its mean.
struct Slide {
  double mean = 0, rms = 0;
};

template <class Renderer>
Slide slide(Renderer& renderer, const VoxelGrid<std::uint8_t>& grid, double isovalue, bool sphere, const Vec3d& top,
            const Vec3d& n, const Vec3d& along, double radius, double above, double step) {
  const DensityField<std::uint8_t, float, typename Renderer::Gradient> field(grid, isovalue);
  renderer.reset();
  constexpr int kLead = 20, kTicks = 100;
  std::vector<double> force;
  for (int i = 0; i < kLead + kTicks; ++i) {
    const double s = step * (std::max(0, i - kLead) - kTicks / 2);
    // Down at the start, then along the plane or round the ball.
    const double lift = i < kLead ? 0.002 * (1 - static_cast<double>(i) / kLead) : 0;
    Vec3d m = n, p = top + s * along;
    if (sphere) {
      m = std::cos(s / radius) * n + std::sin(s / radius) * along;
      p = top - radius * n + radius * m;
    }
    Pose<float> X = Pose<float>::Identity();
    X.translation() = (p + (above + lift) * m).cast<float>();
    const auto out = renderer.render(field, X);
    if (i >= kLead) force.push_back(out.wrench.force.template cast<double>().dot(m));
  }
  double mean = 0, slope = 0, var = 0;
  const double middle = (kTicks - 1) / 2.0;
  for (const double f : force) mean += f / kTicks;
  for (int i = 0; i < kTicks; ++i) {
    slope += (i - middle) * (force[static_cast<std::size_t>(i)] - mean);
    var += (i - middle) * (i - middle);
  }
  slope /= var;
  Slide result{mean, 0};
  for (int i = 0; i < kTicks; ++i) {
    const double r = force[static_cast<std::size_t>(i)] - mean - slope * (i - middle);
    result.rms += r * r / kTicks;
  }
  result.rms = std::sqrt(result.rms);
  return result;
}

}  // namespace

void study_ripple(const StudyOptions& options) {
  Table table(options.folder + "/ripple.csv",
              "shape,renderer,contrast,noise,frequency_Hz,mean_N,ripple_N_rms_mean,ripple_N_rms_max");
  const int slides = options.quick ? 3 : 12;
  for (const bool sphere : {false, true})
    for (const auto& kind : {std::pair(255.0, 0.0), {60.0, 0.0}, {20.0, 0.0}, {255.0, 3.0}, {255.0, 10.0}}) {
      const double contrast = kind.first, noise = kind.second;
      Random random(99);
      struct Bone {
        Vec3d top, n;
        VoxelGrid<std::uint8_t> grid;
      };
      std::vector<Bone> bones;
      RasterOptions o{.size = {65, 65, 65}};
      o.contrast = contrast;
      o.noise = noise;
      constexpr double kRadius = 0.0048;
      for (int i = 0; i < slides; ++i) {
        const Vec3d n = random.unit();
        const Vec3d top = o.middle() + (sphere ? 0.001 * n : Vec3d(kVoxel * random.unit()));
        const Shape shape = sphere ? Shape(Ball{top - kRadius * n, kRadius}) : Shape(HalfSpace{top, n});
        bones.push_back({top, n, rasterise<std::uint8_t>(shape, o)});
      }
      const auto measure = [&](const char* name, auto make, bool point) {
        auto renderer = make();
        for (const double frequency : {100.0, 200.0, 400.0}) {
          double mean = 0, rms = 0, most = 0;
          Random way(7);
          for (const Bone& b : bones) {
            const Vec3d u = b.n.unitOrthogonal(), v = b.n.cross(u);
            const double turn = way.uniform(0, 6.28318);
            const Vec3d along = std::cos(turn) * u + std::sin(turn) * v;
            const double step = frequency * kVoxel / 1000;
            // The depth of 1 N on the mean: by halving.
            double lo = 0, hi = point ? 0.003 : 1.4e-3;
            for (int i = 0; i < 12; ++i) {
              const double depth = 0.5 * (lo + hi);
              const double above = (point ? 0 : kBall.tip_radius) - depth;
              (slide(renderer, b.grid, o.isovalue(), sphere, b.top, b.n, along, kRadius, above, step).mean > 1 ? hi
                                                                                                               : lo) =
                  depth;
            }
            const auto s = slide(renderer, b.grid, o.isovalue(), sphere, b.top, b.n, along, kRadius,
                                 (point ? 0 : kBall.tip_radius) - 0.5 * (lo + hi), step);
            mean += s.mean / slides;
            rms += s.rms / slides;
            most = std::max(most, s.rms);
          }
          table.row(sphere ? "sphere" : "plane", name, contrast, noise, frequency, mean, rms, most);
        }
      };
      const ToolDiscretization line{kBall, LineCounts{}};
      const auto surface = [](int n) { return ToolDiscretization{kBall, SurfaceCounts{.sphere = n}}; };
      measure(
          "line",
          [&] {
            return LineApproxRenderer{line, LineOptions{.stiffness = 800}};
          },
          true);
      measure(
          "line (cell normals)",
          [&] {
            return LineApproxRenderer<float, TranslateRotate, ConstrainedTracking, Frictionless, FullWrench,
                                      AnalyticGradient>{line, LineOptions{.stiffness = 800}};
          },
          true);
      measure(
          "surface ratio 26", [&] { return SurfaceApproxRenderer<float, CollisionRatio>{surface(26)}; }, false);
      measure(
          "surface area 26", [&] { return SurfaceApproxRenderer<float, AreaWeights>{surface(26)}; }, false);
      measure(
          "surface patch 26", [&] { return SurfaceApproxRenderer<float, PatchWeights>{surface(26)}; }, false);
      measure(
          "surface patch 200", [&] { return SurfaceApproxRenderer<float, PatchWeights>{surface(200)}; }, false);
    }
}

}  // namespace trephine::bench
