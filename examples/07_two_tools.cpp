// SPDX-License-Identifier: MIT
// Two hands on one bone, in one servo thread: a drill in one, a suction tube that cuts nothing in the other.
// See the tube lean on the bone, and fall into the groove that the drill makes below it.
#include <trephine/devices.hpp>
#include <trephine/trephine.hpp>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main() {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);

  const Burr burr{.tip_radius = 2_mm}, tube{.tip_radius = 0.8_mm, .shaft_radius = 0.8_mm};
  HapticScene drilling{bone, 300, CoupledToolRenderer{burr, CoupledOptions{}}, Cutting{}};
  HapticScene sucking{bone, 300, CoupledToolRenderer{tube, CoupledOptions{}}};

  // The drill goes along x by 5 mm/s, 1 mm deep; the tube waits on the bone in its way.
  const Vec3d drill_at(5_mm, 16_mm, 12.5_mm), tube_at(14_mm, 16_mm, 11_mm);
  const auto upright = [](const Vec3d& p) { return make_pose<double>(Mat3d::Identity(), p); };
  const auto right = [&](double t) { return HandTarget(upright(drill_at + Vec3d(5_mm * t, 0, 0)), 1); };
  const auto left = [&](double) { return HandTarget(upright(tube_at)); };
  SimulatedDeviceOptions right_arm, left_arm;
  right_arm.X_DH = upright(drill_at);
  left_arm.X_DH = upright(tube_at + Vec3d(0, 0, 2_mm));
  SimulatedDevice right_device(right_arm, right);
  SimulatedDevice left_device(left_arm, left);

  // Always the same order: the tube meets the bone as the drill left it in the same millisecond.
  ServoLoop drill_loop(right_device, drilling, Registration{}, {}, NoPacing{});
  ServoLoop tube_loop(left_device, sucking, Registration{}, {}, NoPacing{});
  double drill_N = 0;
  const TwoReports reports = TwoHands{drill_loop, tube_loop}.run_for(
      std::chrono::seconds(3), [&](const TickRecord& tick) { drill_N = tick.sent.force.norm(); },
      [&](const TickRecord& tick) {
        if (tick.index % 500 == 499)
          std::printf("%.1f s: the drill is felt with %.2f N, the tube with %.2f N at %5.2f mm\n",
                      1e-3 * static_cast<double>(tick.index + 1), drill_N, tick.sent.force.norm(),
                      1e3 * tick.state.X_DH.translation().z());
      });
  std::printf("%s, %s\n", to_string(reports.first.end), to_string(reports.second.end));
}
