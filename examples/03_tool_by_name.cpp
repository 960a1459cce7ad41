// SPDX-License-Identifier: MIT
// Tools by the names of catalogues, and the cutting law: feeding takes thrust, and the spindle's torque is felt.
// See the same push feed each tool as its edges and its size let it, and the torque that the spindle takes for it.
#include <trephine/cutting.hpp>
#include <trephine/tools.hpp>
#include <trephine/trephine.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main() {
  for (const char* name : {"round-2", "round-4", "match-head-3", "twist-2.5"}) {
    const NamedTool tool = tool_by_name(name);
    std::vector<std::int16_t> hounsfield(64 * 64 * 32, 1500);  // bone below, x fastest
    hounsfield.resize(64 * 64 * 48, -1000);                    // air above
    VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.3_mm, 0.3_mm, 0.3_mm}}, hounsfield);

    // A pen of 3 N gets a tenth of the true forces, so a push of 0.4 N drills as 4 N do.
    const CuttingForce law({.edges = tool.edges, .speed = rpm(40'000), .force_scale = 0.1});
    HapticScene scene{bone, 700, CoupledToolRenderer{tool, CoupledOptions{.stiffness = 800}},
                      Cutting{PressureCut{}, law}, DeviceLimits{.force = 3.3, .torque = 0.1}};

    double removed = 0, torque = 0;
    Posed X_WT = Posed::Identity();
    X_WT.translation() = Vec3d(9.45_mm, 9.45_mm, 12_mm);
    for (int tick = 0; tick < 2000; ++tick) {  // a hand that pushes with 0.4 N, and moves at 20 mm/s at most
      const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = true}, 1e-3);
      if (r.wrench.force.z() < 0.4) X_WT.translation().z() -= 20e-6;
      removed += r.removed_mm3;
      torque = r.cutting.torque;
    }
    std::printf("%-12s %4.1f mm down, %5.1f mm3 gone, %4.1f N mm at the spindle\n", name,
                12 - 1e3 * X_WT.translation().z(), removed, 1e3 * torque);
  }
}
