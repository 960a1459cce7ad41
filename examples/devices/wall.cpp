// SPDX-License-Identifier: MIT
#include "wall.hpp"

#include <trephine/core/units.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace devices {

using namespace trephine;

WallReport feel_wall(Opened& device, double seconds, const std::atomic<bool>& quit,
                     const std::function<void(const WallMoment&)>& tell) {
  // Bone below z = 20 mm, 80 mm wide; the user's up is the world's z, and toward the user its -y.
  constexpr int kWide = 80, kHigh = 60, kBone = 20;
  std::vector<std::int16_t> hounsfield(static_cast<std::size_t>(kWide * kWide * kBone), 1200);
  hounsfield.resize(static_cast<std::size_t>(kWide * kWide * kHigh), -1000);
  VoxelGrid<std::int16_t> bone({.size = {kWide, kWide, kHigh}, .spacing = {1_mm, 1_mm, 1_mm}}, hounsfield);
  const double surface = (kBone - 1 + 900.0 / 2200.0) * 1_mm;  // where densities cross 300

  constexpr double kRadius = 3_mm;
  return device.use([&](auto& opened) {
    const DeviceCapabilities able = opened.capabilities();
    const double stiffness = able.stiffness > 0 ? std::min(1000.0, 0.7 * able.stiffness) : 400;
    const double force = able.max_force > 0 ? able.max_force : 3;
    HapticScene scene{
        bone, 300,
        CoupledToolRenderer{Burr{.tip_radius = kRadius}, CoupledOptions{.stiffness = stiffness, .force = force}},
        Damping{{.linear = 1, .only_in_contact = true}}, DeviceLimits{.force = force, .torque = 0}};
    Mat3d R_WU;
    R_WU << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    const Vec3d middle(0.5 * kWide * 1_mm, 0.5 * kWide * 1_mm, surface + kRadius + kWallBelow);
    const Registration registration = device.registration(R_WU, middle);
    ServoLoop loop(opened, scene, registration);
    WallReport report;
    const auto observe = [&](const TickRecord& tick) {
      const double sent = tick.sent.force.norm();
      report.most_force = std::max(report.most_force, sent);
      if (tick.index % 250 == 0) tell({tick.time, sent});
    };
    report.run = loop.run_until(
        [&](const TickRecord& tick) { return tick.time >= seconds || quit.load(std::memory_order_relaxed); }, observe);
    return report;
  });
}

Hand pushing_hand(double seconds) {
  return [seconds](double time) {
    // Down to 4 mm in the wall in the first third, up in the last.
    const double share = std::clamp(3 * std::min(time, seconds - time) / seconds, 0.0, 1.0);
    return HandTarget(make_pose<double>(Mat3d::Identity(), Vec3d(0, -(kWallBelow + 4_mm) * share, 0)));
  };
}

}  // namespace devices
