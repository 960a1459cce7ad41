// SPDX-License-Identifier: MIT
// Drills the tooth phantom with a 6-DOF mouse: nothing is felt, but the force that would be is shown.
#include "../drill/phantom.hpp"
#include "../openhaptics/status_line.hpp"
#include "spacemouse_device.hpp"
#include "spnav_source.hpp"

#include <trephine/core/number.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>

namespace {

using namespace trephine;

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted.store(true); }

int run(double seconds) {
  spacemouse::SpnavSource source;
  auto bone = drill::tooth_phantom<std::uint8_t>({.size = {128, 128, 128}, .spacing = 0.15e-3});
  const Burr burr{.tip_radius = 0.0008, .shaft_radius = 0.0004, .shaft_length = 0.02};
  HapticScene scene{bone, drill::PhantomDensities::kIsovalue,
                    SurfaceApproxRenderer{ToolDiscretization{burr, SurfaceCounts{}}, SurfaceOptions{}},
                    Cutting{RateLimitedCut<>{.rate = 300}}, DeviceLimits{.force = 10, .torque = 1}};
  // The mouse's base: its up is the tooth's, its origin 3 mm over the crown; its z, toward the user, is the tooth's -y.
  Mat3d R_WD;
  R_WD << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Vec3d p_WD(63.5 * 0.15e-3, 63.5 * 0.15e-3, 0.0208);
  const Registration registration(make_pose<double>(R_WD, p_WD));
  // The drill stands upright at the start.
  const Posed X_DH = registration.handle_pose(Posed(Eigen::Translation3d(p_WD)));
  spacemouse::Device device(source, {.speed = 0.02}, X_DH);
  ServoLoop loop(device, scene, registration);
  for (const std::string& warning : loop.warnings()) std::printf("note: %s\n", warning.c_str());
  std::printf("push the cap to move the drill, hold the first button to turn the spindle\n");

  double removed = 0;
  RunReport report;
  {
    openhaptics::StatusLine line({});
    report = loop.run_until(
        [&](const TickRecord& tick) { return interrupted.load() || (seconds > 0 && tick.time >= seconds); },
        [&](const TickRecord& tick) noexcept {
          removed += tick.result.removed_mm3;
          line.publish(tick.result.wrench.force.norm(), removed, tick.input.spindle_on);
        });
  }
  std::cout << report;
  return report.end == RunEnd::kFault ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  double seconds = 0;
  if (argc == 2 && std::strcmp(argv[1], "--help") == 0) {
    std::puts("usage: spacemouse_drill [--seconds S]\nDrills a tooth phantom with a 6-DOF mouse (spacenav driver).");
    return 0;
  }
  if (argc > 1) {
    const char* text = argc == 3 && std::strcmp(argv[1], "--seconds") == 0 ? argv[2] : "";
    seconds = trephine::parse_number(text).value_or(0);
    if (!(seconds > 0) || !(seconds <= 86400)) {
      std::fprintf(stderr, "spacemouse_drill: expected --help or --seconds S with S from 0 to 86400\n");
      return 2;
    }
  }
  try {
    std::signal(SIGINT, on_interrupt);
    return run(seconds);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "spacemouse_drill: %s\n", error.what());
    return 1;
  }
}
