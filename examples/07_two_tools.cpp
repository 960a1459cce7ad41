// SPDX-License-Identifier: MIT
// Two tools on one bone: a drill in one hand, a probe that cuts nothing in the other, ticked in turn by one thread.
// See the probe lean on the bone, and fall into the groove that the drill makes below it.
#include <trephine/trephine.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main() {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);

  const Burr burr{.tip_radius = 2_mm}, ball{.tip_radius = 0.8_mm, .shaft_radius = 0.5_mm};
  HapticScene drill{bone, 300, CoupledToolRenderer{burr, CoupledOptions{}}, Cutting{}};
  HapticScene probe{bone, 300, CoupledToolRenderer{ball, CoupledOptions{}}};

  for (int tick = 0; tick < 3000; ++tick) {
    Posed X_WD = Posed::Identity(), X_WP = Posed::Identity();
    X_WD.translation() = Vec3d(6_mm + 5e-6 * tick, 16_mm, 12_mm);  // a groove along x, at 5 mm/s
    X_WP.translation() = Vec3d(14_mm, 16_mm, 12.2_mm);             // 0.3 mm deep, until the groove is there
    // Always the same order: each tick sees the bone as the one before left it.
    const TickResult d = drill.tick({.X_WT = X_WD, .spindle_on = true}, 1e-3);
    const TickResult p = probe.tick({.X_WT = X_WP, .spindle_on = false}, 1e-3);
    if (tick % 500 == 499)
      std::printf("drill at %4.1f mm: it feels %.2f N, the probe %.2f N\n", 1e3 * X_WD.translation().x(),
                  d.wrench.force.norm(), p.wrench.force.norm());
  }
}
