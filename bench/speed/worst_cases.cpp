// SPDX-License-Identifier: MIT
#include "speed/speed_scene.hpp"
#include "support/fields.hpp"
#include "support/raster.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/bone_volume.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace trephine::bench::speed {
namespace {

/// Times one by one, where the worst counts: p50, p99, p99.9 and the longest [ns].
class Spread {
 public:
  explicit Spread(const Options& options)
      : march_(options.march),
        table_(options.folder + "/speed_spread.csv", "case,compiler,march,ticks,p50_ns,p99_ns,p999_ns,max_ns",
               options.append) {}

  template <class Work>
  void measure(const std::string& name, int ticks, Work&& work) {
    measure(
        name, ticks, [](int i) { return i; }, work);
  }
  /// Times work(prepare(i)) without what prepare takes.
  template <class Prepare, class Work>
  void measure(const std::string& name, int ticks, Prepare&& prepare, Work&& work) {
    std::vector<double> times;
    for (int i = 0; i < ticks; ++i) {
      const auto input = prepare(i);
      const auto begin = Clock::now();
      work(input);
      times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    }
    table_.row(without_commas(name), kCompiler, march_, ticks, percentile(times, 0.5), percentile(times, 0.99),
               percentile(times, 0.999), percentile(times, 1));
    std::fprintf(stderr, "speed: %-44s p50 %.0f ns, p99.9 %.0f ns\n", name.c_str(), percentile(times, 0.5),
                 percentile(times, 0.999));
  }

 private:
  std::string march_;
  Table table_;
};

/// The coupled tool pressed three voxels deep and led over a plane or round a ball.
void measure_coupled(Spread& spread, int ticks) {
  constexpr double kVoxel = 3e-4, kRadius = 20 * kVoxel, kDeep = 3 * kVoxel;
  const test::RasterOptions o{.size = {80, 80, 80}};
  const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized(), u = n.unitOrthogonal(), v = n.cross(u);
  for (const bool ball : {false, true}) {
    const Vec3d top = o.middle();
    const auto bone = ball ? test::rasterise<std::uint8_t>(test::Ball{top - kRadius * n, kRadius}, o)
                           : test::rasterise<std::uint8_t>(test::HalfSpace{top, n}, o);
    const auto surface = shared_bone_surface(bone, o.isovalue());
    // To and fro over 6 mm, at `speed` [m/s].
    const auto slide = [&](const std::string& name, auto tool, double speed) {
      tool.prepare(surface->view());
      const double above = tool.tool().burr().tip_radius - kDeep;
      const auto pose = [&](int i) {
        const double s = 0.003 * std::sin(speed / 0.003 * 1e-3 * i), t = 0.001 * std::cos(speed / 0.003 * 7e-4 * i);
        const Vec3d m = ball ? Vec3d((n + (s * u + t * v) / kRadius).normalized()) : n;
        const Vec3d p =
            ball ? Vec3d(top - kRadius * n + (kRadius + above) * m) : Vec3d(top + s * u + t * v + above * n);
        return make_pose<double>(rotation_between<double>(Vec3d::UnitZ(), (m + 0.3 * u).normalized()), p);
      };
      for (int i = 0; i <= 50; ++i) {  // from above: a tool that appears as deep is without force
        Pose<double> X = pose(0);
        X.translation() += 2 * kDeep * (1 - i / 50.0) * n;
        static_cast<void>(tool.render(surface->view(), X));
      }
      spread.measure(std::string("Coupled, slid over a ") + (ball ? "ball, " : "plane, ") + name, ticks, pose,
                     [&](const Posed& X) { benchmark::DoNotOptimize(tool.render(surface->view(), X)); });
    };
    slide(".03 m/s", coupled(), 0.03);
    slide(".1 m/s", coupled(), 0.1);
    slide(".03 m/s, friction .3", coupled(Coulomb(0.3, 0.3)), 0.03);
    slide(".1 m/s, friction .3", coupled(Coulomb(0.3, 0.3)), 0.1);
  }
}

/// The coupled tool drills into a tilted block: a burr at once, and a match-head of its size by the cutting law.
void measure_drilling(Spread& spread) {
  for (const double voxel : {3e-4, 1e-4}) {
    const int side = static_cast<int>(0.0144 / voxel);
    const test::RasterOptions o{.size = {side, side, side}, .spacing = Vec3d::Constant(voxel)};
    const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized(), top = o.middle() + 0.004 * n;
    const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), n);
    const auto drill = [&](const std::string& what, double speed, auto renderer, auto... stages) {
      auto bone = test::rasterise<std::uint8_t>(test::HalfSpace{top, n}, o);
      HapticScene scene{bone, o.isovalue(), std::move(renderer), std::move(stages)...};
      const double above = scene.renderer().tool().burr().tip_radius;
      spread.measure(what + ", voxels of " + (voxel > 2e-4 ? "0.3 mm" : "0.1 mm"), 1000, [&](int i) {
        const Posed X = make_pose<double>(R, top + (above - speed * 1e-3 * i) * n);
        benchmark::DoNotOptimize(scene.tick({.X_WT = X, .spindle_on = true}, 1e-3));
      });
    };
    drill("Coupled, drills at 5 mm/s", 5e-3, coupled(), Milling{});
    const NamedTool tool = tool_by_name("match-head-3");
    CuttingForce::Options law{.edges = tool.edges, .felt = 0.1};
    law.strength = {.soft = o.air, .cortical = o.air + o.contrast};
    drill("Coupled, match-head-3 by the law at 2 mm/s", 2e-3,
          CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 800}}, CuttingForce(law), Milling{PressureCut{}});
  }
}

/// Least time of the volume that a cut tells: that of the cells which the surface crosses before the burr, twice, for
/// before and after. `forward` points along the burr's motion.
void measure_told_volume(Spread& spread, const std::string& name, const Grid& block, const Vec3d& centre,
                         const Vec3d& forward) {
  struct Row {
    std::uint64_t cells;
    std::array<const std::uint8_t*, 4> voxels;
  };
  const detail::LeastBone<std::uint8_t> least(127.0);
  std::vector<Row> rows;
  std::size_t cells = 0;
  const auto [nx, ny, nz] = block.size();
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int first = 0; first + 1 < nx; first += 64) {
        const auto row = [&](int dj, int dk) { return block.data() + block.index(first, j + dj, k + dk); };
        Row r{0, {row(0, 0), row(1, 0), row(0, 1), row(1, 1)}};
        for (int i = 0; i < 64 && first + i + 1 < nx; ++i) {
          int bone = 0;
          for (const std::uint8_t* v : r.voxels) bone += (v[i] >= least.density) + (v[i + 1] >= least.density);
          const Vec3d middle = block.spacing().x() * (Vec3d(first + i, j, k) + Vec3d::Constant(0.5));
          if (bone > 0 && bone < 8 && (middle - centre).dot(forward) > 0) r.cells |= std::uint64_t{1} << i;
        }
        cells += static_cast<std::size_t>(std::popcount(r.cells));
        if (r.cells != 0) rows.push_back(r);
      }
  spread.measure(name + "; volume of its " + std::to_string(cells) + " crossed cells, twice", 600, [&](int) {
    for (int twice = 0; twice < 2; ++twice) {
      detail::CrossedCells<std::uint8_t> volume(127.0);
      for (const Row& r : rows) volume.add(r.cells, r.voxels[0], r.voxels[1], r.voxels[2], r.voxels[3]);
      benchmark::DoNotOptimize(volume.sum());
    }
  });
}

/// A burr goes through a block of bone by .04 voxel a tick: at once, and at a rate that takes a voxel ten ticks.
void measure_carving(Spread& spread) {
  constexpr double kVoxel = 3e-4;
  constexpr double kTick = 1e-3;
  const auto cut = [&](int radius, const std::string& how, const auto& policy) {
    const int side = 2 * radius + 56;
    const auto voxels = static_cast<std::size_t>(side);
    Grid block({.size = {side, side, side}, .spacing = Vec3d::Constant(kVoxel), .outside = 0},
               std::vector<std::uint8_t>(voxels * voxels * voxels, 255));
    const auto at = [&](int i) {
      return Vec3d(kVoxel * (Vec3d::Constant(radius + 15) + 0.04 * i * Vec3d::Ones().normalized()));
    };
    spread.measure("carving a burr of " + std::to_string(radius) + " voxels" + how, 600, [&](int i) {
      const CutAllowance allowance{.dt = kTick, .tick = static_cast<std::uint32_t>(i)};
      benchmark::DoNotOptimize(
          carve(block, 127.0, SphereCutter(at(i), at(i + 1), radius * kVoxel, i > 0), policy, allowance));
    });
    if (how.empty())
      measure_told_volume(spread, "carving a burr of " + std::to_string(radius) + " voxels", block, at(600),
                          Vec3d::Ones().normalized());
  };
  for (const int radius : {5, 20}) {
    cut(radius, "", GeometricCut{});
    cut(radius, "; at a rate", RateLimitedCut<>{.rate = 255 / (10 * kTick)});
  }
}

}  // namespace

void measure_spread(const Options& options, const Scene& scene) {
  Spread spread(options);
  const int ticks = options.quick ? 2000 : 20000;
  const Field field(scene.tooth, kIsovalue);
  const auto renders = [&](const std::string& name, auto renderer, const Pose<float>& X) {
    spread.measure(name, ticks, [&](int i) {
      Pose<float> wiggled = X;
      wiggled.translation() += (5e-5 * Vec3d(std::sin(0.1 * i), std::cos(0.07 * i), 0)).cast<float>();
      benchmark::DoNotOptimize(renderer.render(field, wiggled));
    });
  };
  const Pose<float> buried = scene.pose(-0.006, 0.0);
  renders("Surface, as deep as it goes", surface(), buried);
  renders("Line, as deep as it goes", line(), buried);
  measure_coupled(spread, ticks);
  measure_drilling(spread);
  measure_carving(spread);
}

}  // namespace trephine::bench::speed
