// SPDX-License-Identifier: MIT
// Drills a small block of bone on a Force Dimension device, or on a simulated one. Not affiliated with Force Dimension.
#include "../devices/arguments.hpp"
#include "../openhaptics/status_line.hpp"
#include "device_setup.hpp"
#include "force_dimension_device.hpp"

#include <trephine/device/servo_loop.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

namespace {

using namespace trephine;

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted.store(true); }

const char* const kUsage =
    "usage: force_dimension_drill [options]\n"
    "Drills a small block of bone with a Force Dimension device (this program is not affiliated with Force "
    "Dimension).\n"
    "The first button or the closed gripper turns the spindle. Built without the SDK it drills with a simulated "
    "device\n"
    "and hand: omega.3, omega.6, sigma.7, lambda.7 or 'lambda.7 left'.\n\n"
    "  --device NAME   model, as 'sigma.7' or 'lambda.7 left' (the first that opens)\n"
    "  --by-hand       calibrate by hand: without it the device may move its handle by itself at the start\n"
    "  --seconds S     end by itself (run until Ctrl-C)\n"
    "  --help          this text\n";

/// A block of 16 x 16 x 8 mm whose top is at z = 0 in W.
VoxelGrid<std::int16_t> block() {
  constexpr int n = 48, deep = 24;
  constexpr double h = 0.4e-3;
  std::vector<std::int16_t> hounsfield(static_cast<std::size_t>(n * n * n), -1000);
  for (int k = 2; k < 2 + deep; ++k)
    for (int j = 4; j < n - 4; ++j)
      for (int i = 4; i < n - 4; ++i) hounsfield[static_cast<std::size_t>((k * n + j) * n + i)] = 1200;
  const double middle = 0.5 * (n - 1) * h;
  const Posed X_WG(Eigen::Translation3d(-middle, -middle, -(1.5 + deep) * h));
  return VoxelGrid<std::int16_t>{{.size = {n, n, n}, .spacing = {h, h, h}, .X_WG = X_WG}, hounsfield};
}

int run(const devices::Arguments& arguments) {
  const double seconds = arguments.number("--seconds", 0, 0.1, 86400);  // 0: until Ctrl-C
  const force_dimension::DeviceOptions options{.name = arguments.text("--device", {}),
                                               .auto_init = !arguments.has("--by-hand")};
  std::printf("%s\n", force_dimension::set_up_devices().c_str());
  if (options.auto_init) std::printf("let go of the handle: the device may calibrate itself\n");
  force_dimension::Device device(options);
  const DeviceCapabilities able = device.capabilities();
  std::printf("device: %s, %d/%d degrees of freedom in/out, %.2g N, %.2g N.m\n", able.name.c_str(), able.input_dof,
              able.output_dof, able.max_force, able.max_torque);

  auto bone = block();
  // 0.8 of what the device renders: more begins to vibrate.
  const CoupledOptions coupling{.stiffness = std::min(2000.0, 0.8 * able.stiffness),
                                .force = able.max_force,
                                .torque = able.output_dof < 6 ? 0 : able.max_torque};
  HapticScene scene{bone, 300, CoupledToolRenderer{Burr{.tip_radius = 1.5e-3, .shaft_length = 0.04}, coupling},
                    Cutting{RateLimitedCut<>{.rate = 1000}},
                    DeviceLimits{.force = able.max_force, .torque = able.max_torque}};
  // The middle of the device's workspace lies 10 mm above the bone; both have z up.
  const Registration registration(Posed(Eigen::Translation3d(0, 0, 0.010)));
  ServoLoop loop(device, scene, registration, ServoOptions{.spindle_buttons = 1 | force_dimension::kGripperButton});
  for (const std::string& warning : loop.warnings()) std::printf("note: %s\n", warning.c_str());

  double removed = 0, most_force = 0;
  RunReport report;
  {
    openhaptics::StatusLine line([&] { return std::string(advice(device.trip())); });
    report =
        loop.run_until([&](const TickRecord& t) { return interrupted.load() || (seconds > 0 && t.time >= seconds); },
                       [&](const TickRecord& t) noexcept {
                         removed += t.result.removed_mm3;
                         most_force = std::max(most_force, t.sent.force.norm());
                         line.publish(t.sent.force.norm(), removed, t.input.spindle_on);
                       });
  }
  std::cout << report;
  std::printf("  %.0f Hz, removed %.2f mm3, at most %.2f N\n", static_cast<double>(report.ticks) / report.wall_time,
              removed, most_force);
  return report.end == RunEnd::kFault ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const devices::Arguments arguments(argc, argv, {"--device", "--seconds"}, {"--by-hand", "--help", "-h"});
    if (arguments.has("--help") || arguments.has("-h")) {
      std::fputs(kUsage, stdout);
      return 0;
    }
    std::signal(SIGINT, on_interrupt);
    return run(arguments);
  } catch (const devices::UsageError& error) {
    std::fprintf(stderr, "force_dimension_drill: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "force_dimension_drill: %s\n", error.what());
    return 1;
  }
}
