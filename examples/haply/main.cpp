// SPDX-License-Identifier: MIT
// Drills a small block of bone with a Haply Inverse3, or against `haply_service`. Not affiliated with Haply.
#include "../devices/arguments.hpp"
#include "../drill/watcher.hpp"
#include "haply_device.hpp"

#include <trephine/device/servo_loop.hpp>
#include <trephine/trephine.hpp>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <thread>
#include <vector>

namespace {

using namespace trephine;

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted.store(true); }

constexpr const char* kUsage =
    "usage: haply_drill [options]\n"
    "Drills a block of bone 5 mm under the handle's first place, by the Haply Inverse Service or by haply_service "
    "(this\n"
    "program is not affiliated with Haply). Button a turns the spindle. Hold the handle upright, like a pen.\n\n"
    "  --address A     numeric address of the service (127.0.0.1)\n"
    "  --port P        its simulation channel (10001)\n"
    "  --device ID     which Inverse3 (the first)\n"
    "  --rate HZ       of the loop, 100 to 10000 (the device's, 4000)\n"
    "  --stiffness K   of the bone, 50 to 3000 N/m (600)\n"
    "  --bench         no bone and no force: measure the exchange\n"
    "  --seconds S     end by itself (10 with --bench, else run until Ctrl-C)\n"
    "  --help          this text\n";

/// What the printing thread sees of a run.
struct Shown {
  std::atomic<double> force{0}, removed{0};
  std::atomic<std::uint64_t> ticks{0};
};

/// Prints every change of the device, and once a second how the drilling goes.
class Printer {
 public:
  Printer(haply::Device& device, const Shown& shown)
      : device_(device), shown_(shown), watcher_(std::chrono::milliseconds(100), [this](bool) { look(); }) {}

 private:
  void look() {
    haply::Change change;
    while (device_.next_change(change)) std::printf("%8.3f s  %s\n", change.time, text(change.trouble));
    if (++looks_ % 10 == 0) {
      const std::uint64_t ticks = shown_.ticks.load(std::memory_order_relaxed);
      const auto now = ServoClock::now();
      const double rate = static_cast<double>(ticks - ticks_) / std::chrono::duration<double>(now - last_).count();
      ticks_ = ticks;
      last_ = now;
      std::printf("%5.0f Hz  %5.2f N  %7.2f mm3 removed  handle's age %3.0f ms\n", rate,
                  shown_.force.load(std::memory_order_relaxed), shown_.removed.load(std::memory_order_relaxed),
                  1e3 * device_.handle_age());
    }
    std::fflush(stdout);
  }

  haply::Device& device_;
  const Shown& shown_;
  int looks_ = 0;
  std::uint64_t ticks_ = 0;
  ServoClock::time_point last_ = ServoClock::now();
  drill::Watcher watcher_;
};

/// Waits for a good state, at most two seconds; the last one there is.
DeviceState first_state(haply::Device& device) {
  DeviceState state;
  for (int ms = 0; ms < 2000 && device.read(state) != DeviceStatus::kOk; ++ms)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return state;
}

template <class Scene>
RunReport run_loop(haply::Device& device, Scene& scene, const Registration& registration, const ServoOptions& options,
                   double seconds, double& most) {
  ServoLoop loop(device, scene, registration, options);
  for (const std::string& warning : loop.warnings()) std::printf("note: %s\n", warning.c_str());
  Shown shown;
  const Printer printer(device, shown);
  double removed = 0;
  return loop.run_until(
      [&](const TickRecord& tick) {
        return interrupted.load(std::memory_order_relaxed) || (seconds > 0 && tick.time >= seconds);
      },
      [&](const TickRecord& tick) noexcept {
        removed += tick.result.removed_mm3;
        most = std::max(most, tick.sent.force.norm());
        shown.force.store(tick.sent.force.norm(), std::memory_order_relaxed);
        shown.removed.store(removed, std::memory_order_relaxed);
        shown.ticks.store(tick.index + 1, std::memory_order_relaxed);
      });
}

/// Costs nothing and gives no force: what remains is the exchange.
struct NoScene {
  static constexpr bool kHasTorque = false;
  TickResult tick(const TickInput&, double) noexcept { return {}; }
};

RunReport drill_block(haply::Device& device, const ServoOptions& options, double stiffness, double seconds,
                      double& most) {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);
  const DeviceCapabilities able = device.capabilities();
  const Burr burr{.tip_radius = 1.5_mm};
  const CoupledOptions coupled{.stiffness = stiffness, .force = 5, .torque = 0};  // no motors turn the handle
  HapticScene scene{bone, 300, CoupledToolRenderer{burr, coupled}, Cutting{AdvancingCut{.speed = 4_mm /* a second */}},
                    DeviceLimits{.force = able.max_force, .torque = 1}};
  // The burr's lowest point 5 mm over the middle of the block.
  const Vec3d start(16_mm, 16_mm, 11.75_mm + burr.tip_radius + 5_mm);
  Posed X_WD = Posed::Identity(), X_HT = Posed::Identity();
  X_WD.translation() = start - first_state(device).X_DH.translation();
  // The handle's +y points away from the hand, the tool's +z toward it.
  if (able.input_dof == 6) X_HT.linear() = rotation_from_vector<double>(Vec3d(1.5707963267948966, 0, 0));
  return run_loop(device, scene, Registration(X_WD, X_HT), options, seconds, most);
}

int run(const devices::Arguments& arguments) {
  const bool bench = arguments.has("--bench");
  haply::DeviceOptions where;
  where.address = arguments.text("--address", where.address);
  where.port = arguments.port(1);
  where.device_id = arguments.text("--device", "");
  ServoOptions options;
  options.rate = arguments.number("--rate", 0, 100, 10000);
  const double stiffness = arguments.number("--stiffness", 600, 50, 3000);
  const double seconds = arguments.number("--seconds", bench ? 10 : 0, 0.1, 86400);

  haply::Device device(where);
  std::printf("device: %s\n", device.capabilities().name.c_str());
  for (const std::string& warning : device.warnings()) std::printf("note: %s\n", warning.c_str());
  std::signal(SIGINT, on_interrupt);
  double most = 0;
  NoScene none;
  const RunReport report = bench ? run_loop(device, none, Registration{}, options, seconds, most)
                                 : drill_block(device, options, stiffness, seconds, most);
  device.stop();
  const TimeSummary trip = device.round_trip();
  std::printf("%s: %s\n", to_string(report.end), report.reason.c_str());
  std::printf(
      "%.0f Hz, %.0f states a second, round trip %.3f ms (median), %.3f ms (p99), %.3f ms (p99.9), %.2f ms (most)\n",
      static_cast<double>(report.ticks) / report.wall_time, static_cast<double>(trip.count) / report.wall_time,
      1e3 * trip.p50, 1e3 * trip.p99, 1e3 * trip.p99_9, 1e3 * trip.max);
  std::printf("at most %.2f N, %llu safety trips, %llu ramps\n", most,
              static_cast<unsigned long long>(report.safety_trips), static_cast<unsigned long long>(report.ramps));
  return report.end == RunEnd::kFault ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const devices::Arguments arguments(
        argc, argv, {"--address", "--port", "--device", "--rate", "--stiffness", "--seconds"}, {"--bench", "--help"});
    if (arguments.has("--help")) return std::fputs(kUsage, stdout) < 0 ? 1 : 0;
    return run(arguments);
  } catch (const devices::UsageError& error) {
    std::fprintf(stderr, "haply_drill: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "haply_drill: %s\n", error.what());
    return 1;
  }
}
