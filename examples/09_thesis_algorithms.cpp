// SPDX-License-Identifier: MIT
// The thesis' two algorithms as it writes them, beside ours, pressed into a bone.
// See the thesis' Surface step as vertices come and go (Eq. 16), where ours follows the depth; both Lines feel alike.
#include <trephine/thesis.hpp>
#include <trephine/trephine.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main() {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);

  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 40_mm};
  const ToolDiscretization centreline{burr, LineCounts{}};
  const ToolDiscretization vertices{burr, SurfaceCounts::thesis()};
  HapticScene thesis_line{bone, 300, ThesisLine{centreline, {.stiffness = 500}}};
  HapticScene thesis_surface{bone, 300, ThesisSurface{vertices, {.stiffness = 500}}};
  HapticScene line{bone, 300, LineApproxRenderer{centreline, {.stiffness = 500}}};
  HapticScene surface{bone, 300, SurfaceApproxRenderer{vertices, {.stiffness = 500}}};

  std::printf("depth of the burr's end   Line: thesis, ours   Surface: thesis, ours [N]\n");
  for (int tick = 1; tick <= 1500; ++tick) {
    Posed X_WT = Posed::Identity();
    const double depth = 1e-6 * tick;  // down by 1 mm/s
    X_WT.translation() = Vec3d(16_mm, 16_mm, 13.2045_mm - depth);
    const TickInput input{.X_WT = X_WT, .spindle_on = false};
    TickInput tip = input;  // Line's tip is a point at T's origin: here it goes where the burr's end is
    tip.X_WT.translation().z() -= burr.tip_radius;
    const TickResult a = thesis_line.tick(tip, 1e-3), b = line.tick(tip, 1e-3);
    const TickResult c = thesis_surface.tick(input, 1e-3), d = surface.tick(input, 1e-3);
    if (tick % 150 == 0)
      std::printf("%20.2f mm %13.3f %7.3f %14.3f %7.3f\n", 1e3 * depth, a.wrench.force.norm(), b.wrench.force.norm(),
                  c.wrench.force.norm(), d.wrench.force.norm());
  }
}
