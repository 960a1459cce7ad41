// SPDX-License-Identifier: MIT
#include "../examples/drill/phantom.hpp"
#include "common/command_line.hpp"
#include "common/percentile.hpp"
#include "common/table.hpp"

#include <trephine/trephine.hpp>

#include <chrono>
#include <cstdio>

/// Figures 26, 27 and 29 of the thesis again: rate against vertices and slices, on a tooth of 256 x 256 x 176 voxels.
///   bench_thesis_rates --out DIR [--quick]
namespace {

using namespace trephine;
using Clock = std::chrono::steady_clock;
using Grid = VoxelGrid<std::uint8_t>;

// A hand that slides a tool over the crown, its shaft leaning, a millimetre down and up twice a second.
struct Strokes {
  Vec3d p_WT;
  Mat3d R_WT;
  [[nodiscard]] HandTarget operator()(double t) const noexcept { return HandTarget{at(t)}; }
  [[nodiscard]] Posed at(double t) const noexcept {
    const double s = std::sin(12.566 * t);
    const Vec3d move(0.002 * std::sin(3 * t), 0.002 * std::cos(2 * t), 0.001 * s);
    return make_pose<double>(R_WT * rotation_from_vector(Vec3d(0.1 * std::sin(5 * t), 0.1 * std::cos(4 * t), 0)),
                             p_WT + move);
  }
};

struct Rates {
  double tick_ns, servo_Hz;
};

template <class Renderer>
Rates measure(Grid& tooth, Renderer renderer, const Strokes& strokes, double seconds) {
  HapticScene scene{tooth, drill::PhantomDensities::kIsovalue, std::move(renderer)};
  std::vector<double> times;
  for (int i = 0; i < 4000; ++i) {
    const TickInput input{.X_WT = strokes.at(1e-3 * i)};
    const auto begin = Clock::now();
    const TickResult result = scene.tick(input, 1e-3);
    times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    static_cast<void>(result);
  }
  // The rate that a servo loop keeps, by the clock, at the device's 1 kHz.
  SimulatedDeviceOptions options;
  options.X_DH = strokes.at(0);
  SimulatedDevice device(options, strokes);
  ServoLoop<decltype(device), decltype(scene)> loop(device, scene, Registration());
  const RunReport report = loop.run_for(std::chrono::duration<double>(seconds));
  return {bench::percentile(times, 0.5), static_cast<double>(report.ticks) / report.wall_time};
}

}  // namespace

int main(int argc, char** argv) {
  const bench::CommandLine options(argc, argv);
  Grid tooth = drill::tooth_phantom<std::uint8_t>();
  const Burr burr{};
  // Above the crown's middle: the first bone below.
  const Vec3d middle = 0.5e-4 * Vec3d(255, 255, 175);
  const DensityField<std::uint8_t, double> field(tooth, drill::PhantomDensities::kIsovalue);
  Vec3d top = middle;
  top.z() = 0.0175;
  while (top.z() > 0 && field.value(top) < 0) top.z() -= 5e-5;
  const Strokes strokes{top + Vec3d(0, 0, 0.0008), rotation_from_vector(Vec3d(0.3, 0, 0))};
  bench::Table table(options.folder + "/thesis_rates.csv",
                     "renderer,stepping,vertices,slices,tick_ns_median,rate_kHz,servo_rate_Hz,thesis_rate_Hz");
  const double seconds = options.quick ? 0.3 : 2;
  const auto row = [&](const char* renderer, const char* stepping, int vertices, int slices, const Rates& r,
                       int thesis) {
    table.row(renderer, stepping, vertices, slices, r.tick_ns, 1e6 / r.tick_ns, r.servo_Hz, thesis);
    std::fprintf(stderr, "thesis_rates: %s %s %d %d: %.0f ns\n", renderer, stepping, vertices, slices, r.tick_ns);
  };
  for (const auto& [n, thesis] : {std::pair(50, 984), {100, 964}, {250, 884}, {500, 795}, {1000, 544}})
    row("line", "translate_rotate", n, 0,
        measure(tooth, LineApproxRenderer{ToolDiscretization{burr, LineCounts{.shaft = n}}}, strokes, seconds), thesis);
  row("line", "ray_cast", 50, 0,
      measure(tooth, LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}, LineOptions{}, RayCast{}}, strokes,
              seconds),
      973);
  for (const auto& [n, thesis] : {std::pair(10, 974), {20, 951}, {30, 922}, {50, 837}, {100, 622}})
    row("surface", "", 26 + 1 + n * 9, n,
        measure(
            tooth,
            SurfaceApproxRenderer{ToolDiscretization{burr, SurfaceCounts{.sphere = 26, .slices = n, .per_slice = 8}}},
            strokes, seconds),
        thesis);
}
