// SPDX-License-Identifier: MIT
// Drills with a device by name, here a simulated one in a simulated hand: the servo loop reads, ticks and writes.
// See the hand come down on the bone, lean on it, and sink in once the spindle turns.
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

  const DevicePreset touch = device_preset("Touch");
  const CoupledToolRenderer drill{Burr{.tip_radius = 1.5_mm}, touch};
  HapticScene scene{bone, 300, drill, Cutting{AdvancingCut{.speed = 4_mm /* a second */}}, touch.limits};

  // The hand goes down by 2 mm/s from 15 mm, and presses the button after two seconds.
  const auto hand = [](double t) {
    HandTarget target;
    target.X_DH.translation() = Vec3d(16_mm, 16_mm, 15_mm - 2_mm * t);
    target.buttons = t > 2 ? 1 : 0;
    return target;
  };
  SimulatedDeviceOptions simulated{.output_dof = 3};
  simulated.X_DH.translation() = Vec3d(16_mm, 16_mm, 15_mm);
  SimulatedDevice device(simulated, hand);  // yours: a class with read and write, as examples/openhaptics has one

  ServoLoop loop(device, scene, Registration{}, ServoOptions{}, NoPacing{});  // a real device needs no NoPacing
  double removed = 0;
  const RunReport report = loop.run_for(std::chrono::seconds(4), [&](const TickRecord& tick) {
    removed += tick.result.removed_mm3;
    if ((tick.index + 1) % 500 == 0)
      std::printf("%.1f s: handle at %5.2f mm, %.2f N, %5.2f mm3 gone\n", 1e-3 * static_cast<double>(tick.index + 1),
                  1e3 * tick.input.X_WT.translation().z(), tick.result.wrench.force.norm(), removed);
  });
  std::printf("%s\n", to_string(report.end));
}
