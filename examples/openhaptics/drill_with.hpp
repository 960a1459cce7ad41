// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/scene.hpp"
#include "session.hpp"
#include "status_line.hpp"

#include <trephine/device/servo_loop.hpp>

#include <algorithm>
#include <cstdio>

namespace openhaptics {

/// Stiffness of the bone under the tip [N/m]: what is asked for, or 0.8 of what the device says it can render, felt
/// through the registration's scale.
[[nodiscard]] inline double bone_stiffness(const Session& session) {
  constexpr double kWanted = 800;
  constexpr double kMargin = 0.8;
  const double most = session.handled.capabilities().stiffness;
  const double device_per_bone = session.registration.device_stiffness(1);
  return most > 0 ? std::min(kWanted, kMargin * most / device_per_bone) : kWanted;
}

/// What to say beside the numbers, at a moment.
[[nodiscard]] inline std::string note(const Session& session, std::uint64_t& trips_seen) {
  switch (session.device.calibration()) {
    case Calibration::kNeedsHand:
      return "calibrate: put the stylus into its inkwell, or move the arm to its reset position";
    case Calibration::kBusy:
      return "calibrating";
    default:
      break;
  }
  const std::uint64_t trips = session.device.trips();
  const bool tripped = trips != trips_seen;
  trips_seen = trips;
  if (tripped) return "safety trip: no force until it has passed";
  return session.handled.held() ? "clutch" : "";
}

/// The main job's scene round any renderer, with more stages if any, on the session's device.
template <class Renderer, class... More>
[[nodiscard]] Outcome drill_with(const Renderer& renderer, const Session& session, const More&... more) {
  using namespace trephine;
  drill::Bone& bone = session.bone;
  const DeviceCapabilities able = session.handled.capabilities();
  auto scene = drill::scene_of(bone.grid, bone, renderer,
                               DeviceLimits{.force = able.max_force, .torque = able.max_torque}, more...);
  ServoLoop loop(session.handled, scene, session.registration, ServoOptions{.spindle_buttons = HD_DEVICE_BUTTON_1});
  for (const std::string& warning : loop.warnings()) std::printf("note: %s\n", warning.c_str());

  Outcome outcome;
  std::uint64_t trips_seen = 0;
  StatusLine line([&] { return note(session, trips_seen); });
  const auto over = [&](const TickRecord& tick) {
    return session.quit.load(std::memory_order_relaxed) || (session.seconds > 0 && tick.time >= session.seconds);
  };
  const auto observe = [&](const TickRecord& tick) noexcept {
    outcome.removed_mm3 += tick.result.removed_mm3;
    const double force = tick.sent.force.norm();
    outcome.most_force = std::max(outcome.most_force, force);
    line.publish(force, outcome.removed_mm3, tick.input.spindle_on);
  };
  outcome.report = loop.run_until(over, observe);
  return outcome;
}

}  // namespace openhaptics
