// SPDX-License-Identifier: MIT
#include "speed/speed_scene.hpp"

#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace trephine::bench::speed {
namespace {

/// A scene whose ticks are timed by themselves, without device and pacing.
template <class Scene>
struct TimedScene {
  Scene& scene;
  std::vector<double>& times;  // [ns], as long as there is room

  TickResult tick(const TickInput& input, double dt) noexcept {
    const auto begin = Clock::now();
    const TickResult result = scene.tick(input, dt);
    if (times.size() < times.capacity())
      times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    return result;
  }
};
template <class Scene>
TimedScene(Scene&, std::vector<double>&) -> TimedScene<Scene>;

/// Instead of a scene: a tick that does nothing for as long as a renderer's takes. What it misses is the machine's.
struct Waiting {
  double time;  // [ns]

  TickResult tick(const TickInput&, double) const noexcept {
    const auto end = Clock::now() + std::chrono::duration<double, std::nano>(time);
    while (Clock::now() < end) {
    }
    return {};
  }
};

}  // namespace

/// A servo loop that spins from tick to tick on a simulated device, whose hand drills over the crown: which ticks' own
/// work fits the period, and, apart, how late the machine lets them begin. Beside the coupled tool stands a tick that
/// waits for the mean time of its ticks that fit, so it is interrupted as often.
void measure_servo(const Options& options, const Scene& scene) {
  Table table(options.folder + "/speed_servo.csv",
              "renderer,rate_Hz,voxel_mm,compiler,march,ticks,share_within_period,p50_ns,p999_ns,"
              "missed_periods,lateness_p50_ns,lateness_p999_ns",
              options.append);
  // Returns the mean time of the ticks within the period [ns].
  const auto run = [&](const char* name, auto& drill, double rate, double voxel) {
    const auto hand = [&scene](double t) {
      const Vec3d at =
          scene.top + Vec3d(0.002 * std::sin(3 * t), 0.002 * std::cos(2 * t), 0.001 * std::sin(12.566 * t));
      return HandTarget(make_pose<double>(rotation_from_vector(Vec3d(0.3, 0.1 * std::sin(5 * t), 0)), at), 1);
    };
    SimulatedDeviceOptions simulated;
    simulated.rate = rate;
    simulated.substeps = 1;  // a tenth of a millisecond and less
    simulated.X_DH = hand(0).X_DH;
    SimulatedDevice device(simulated, hand);
    const double seconds = options.quick ? 0.2 : 1.0;
    std::vector<double> times;
    times.reserve(static_cast<std::size_t>(rate * seconds) + 1);
    TimedScene timed{drill, times};
    ServoOptions servo;
    servo.rate = rate;
    ServoLoop loop(device, timed, Registration{}, servo, SleepSpinPacing{});
    const RunReport report = loop.run_for(std::chrono::duration<double>(seconds));
    std::vector<double> within = times;
    std::erase_if(within, [&](double ns) { return ns > 1e9 / rate; });
    const double share = static_cast<double>(within.size()) / static_cast<double>(times.size());
    table.row(name, rate, 1e3 * voxel, kCompiler, options.march, times.size(), share, percentile(times, 0.5),
              percentile(times, 0.999), report.missed_deadlines, 1e9 * report.lateness.p50,
              1e9 * report.lateness.p99_9);
    std::fprintf(stderr, "speed: %s at %.0f Hz, %.1f mm: %.5f of ticks within the period\n", name, rate, 1e3 * voxel,
                 share);
    return std::accumulate(within.begin(), within.end(), 0.0) / static_cast<double>(within.size());
  };
  const auto mill = [&](const char* name, auto renderer, double rate, double voxel) {
    Grid tooth = tooth_of(voxel);
    HapticScene drill{tooth, kIsovalue, std::move(renderer), Cutting{}, DeviceLimits{.force = 3.3, .torque = 0.1}};
    return run(name, drill, rate, voxel);
  };
  for (const double voxel : {4e-4, 1e-4})
    for (const double rate : {10e3, 40e3}) {
      mill("surface", surface(), rate, voxel);
      mill("line", line(), rate, voxel);
      Waiting waiting{mill("coupled", coupled(), rate, voxel)};
      run("waiting", waiting, rate, voxel);
    }
}

}  // namespace trephine::bench::speed
