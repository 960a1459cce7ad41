// SPDX-License-Identifier: MIT
#include <trephine/compiled/scene.hpp>
#include <trephine/core/units.hpp>

#include <cstdint>
#include <iostream>
#include <vector>

int main() {
  using namespace trephine;
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  compiled::Bone bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);

  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 40_mm};
  compiled::Scene scene(bone, 300 /* isovalue */, burr, {.coupled = {.stiffness = 800, .force = 3.3, .torque = 0.1}},
                        {.cut = GeometricCut{}, .limits = {.force = 3.3, .torque = 0.1}});

  for (int tick = 0; tick < 1000; ++tick) {
    Posed X_WT = Posed::Identity();
    X_WT.translation() = Vec3d(16_mm, 16_mm, 14_mm - 4e-6 * tick);
    const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = tick > 800}, 1e-3);
    if (tick % 200 == 199) std::cout << r.wrench.force.transpose() << " N, " << r.removed_mm3 << " mm3\n";
  }
}
