// SPDX-License-Identifier: MIT
// The thesis' two algorithms and the coupled tool, side by side on one path: over a bone, into it, and along it.
// See Line and the coupled tool feel stiffness times depth, and Surface sink in by its springs' own law.
#include <trephine/thesis.hpp>
#include <trephine/trephine.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main() {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);

  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 40_mm};
  HapticScene line{bone, 300, LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}, {.stiffness = 500}}};
  HapticScene surface{bone, 300, SurfaceApproxRenderer{ToolDiscretization{burr, SurfaceCounts{}}, {.stiffness = 500}}};
  HapticScene coupled{bone, 300, CoupledToolRenderer{burr, CoupledOptions{.stiffness = 500}}};

  std::printf("depth of the burr's end   Line   Surface   coupled tool [N]\n");
  for (int tick = 0; tick < 3000; ++tick) {
    Posed X_WT = Posed::Identity();
    const double depth = tick < 1500 ? 1e-6 * tick : 1.5_mm;  // down by 1 mm/s, then along by 4 mm/s
    X_WT.translation() = Vec3d(12_mm + 4e-6 * std::max(0, tick - 1500), 16_mm, 13.2045_mm - depth);
    const TickInput input{.X_WT = X_WT, .spindle_on = false};
    TickInput tip = input;  // Line's tip is a point at T's origin: here it goes where the burr's end is
    tip.X_WT.translation().z() -= burr.tip_radius;
    const TickResult a = line.tick(tip, 1e-3), b = surface.tick(input, 1e-3), c = coupled.tick(input, 1e-3);
    if (tick % 300 == 299)
      std::printf("%20.2f mm %7.3f %9.3f %9.3f\n", 1e3 * depth, a.wrench.force.norm(), b.wrench.force.norm(),
                  c.wrench.force.norm());
  }
}
