// SPDX-License-Identifier: MIT
// Drill a CT volume by hand, on a device behind the OpenHaptics HD interface. Not affiliated with OpenHaptics.
#include "../drill/spot.hpp"
#include "arguments.hpp"
#include "demo_hand.hpp"
#include "device_setup.hpp"
#include "session.hpp"

#include <array>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <utility>

namespace {

using namespace openhaptics;

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);
void on_interrupt(int) { interrupted.store(true); }

int run(const Arguments& arguments) {
  drill::Options what;
  what.skull = arguments.skull;
  what.tool = arguments.tool;
  drill::Bone bone = drill::load_bone(what);
  drill::Spot spot = drill::find_spot(bone);
  if (auto fine = drill::resampled_around(bone, spot.p_W, what)) {
    bone = std::move(*fine);
    spot = drill::spot_near(bone, spot.p_W);
  }
  const Workspace workspace = workspace_over(spot, arguments.scale);
  std::printf("%s\n", set_up_devices(DemoHand(spot, bone.burr.tip_radius, workspace)).c_str());

  Device device({.name = arguments.device});
  HandledDevice handled(device, HD_DEVICE_BUTTON_2);
  const trephine::DeviceCapabilities able = handled.capabilities();
  std::array<char, 48> burr{};
  std::snprintf(burr.data(), burr.size(), "burr of %.1f mm diameter", 2e3 * bone.burr.tip_radius);
  std::printf("device: %s, %d/%d degrees of freedom in/out, %.2g N, %.2g N.m; %s, %s, %s\n", able.name.c_str(),
              able.input_dof, able.output_dof, able.max_force, able.max_torque, bone.name.c_str(),
              bone.tool ? bone.tool_name.c_str() : burr.data(), name_of(arguments.algorithm));

  std::signal(SIGINT, on_interrupt);
  const Session session{device, handled, bone, workspace.registration, arguments.seconds, interrupted};
  const auto perform = arguments.algorithm == Algorithm::kLine      ? drill_line
                       : arguments.algorithm == Algorithm::kSurface ? drill_surface
                                                                    : drill_coupled;
  const Outcome outcome = perform(session);
  std::cout << outcome.report;
  std::printf("  %.0f Hz, removed %.2f mm3, at most %.2f N\n",
              static_cast<double>(outcome.report.ticks) / outcome.report.wall_time, outcome.removed_mm3,
              outcome.most_force);
  return outcome.report.end == trephine::RunEnd::kFault ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments arguments = parse_arguments(argc, argv);
    if (arguments.help) {
      std::fputs(usage().c_str(), stdout);
      return 0;
    }
    return run(arguments);
  } catch (const UsageError& error) {
    std::fprintf(stderr, "openhaptics_drill: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "openhaptics_drill: %s\n", error.what());
    return 1;
  }
}
