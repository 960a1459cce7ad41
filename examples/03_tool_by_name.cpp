// SPDX-License-Identifier: MIT
// Tools by the names of catalogues, and the cutting law: feeding takes thrust, and the spindle's torque is felt.
// See the same push feed each tool as its edges and its size let it, and its teeth tremble in the hand as they pass.
#include <trephine/cutting.hpp>
#include <trephine/tools.hpp>
#include <trephine/trephine.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <vector>

using namespace trephine;

int main() {
  constexpr double dt = 1e-4;  // a loop of 1 kHz carries teeth up to 400 Hz, and this one up to 4 kHz
  for (const char* name : {"round-2", "round-4", "match-head-3", "twist-2.5"})
    for (const double share : {0.0, 1.0}) {  // of the teeth's ripple
      const NamedTool tool = tool_by_name(name);
      std::vector<std::int16_t> hounsfield(64 * 64 * 32, 1500);  // bone below, x fastest
      hounsfield.resize(64 * 64 * 48, -1000);                    // air above
      VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.3_mm, 0.3_mm, 0.3_mm}}, hounsfield);

      // A pen of 3 N gets a tenth of the true forces, so a push of 0.4 N drills as 4 N do.
      const CuttingForce law({.edges = tool.edges, .speed = rpm(10'000), .force_scale = 0.1});
      HapticScene scene{bone, 700, CoupledToolRenderer{tool, CoupledOptions{.stiffness = 800}},
                        Cutting{PressureCut{}, CuttingVibration{law, {.depth = share}}},
                        DeviceLimits{.force = 3.3, .torque = 0.1}};

      double removed = 0, mean = 0, square = 0;
      CuttingSummary cut;
      Posed X_WT = Posed::Identity();
      X_WT.translation() = Vec3d(9.45_mm, 9.45_mm, 11_mm);
      for (int tick = 0; tick < 5000; ++tick) {  // a hand that pushes with 0.4 N, and moves at 20 mm/s at most
        const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = true}, dt);
        if (r.wrench.force.z() < 0.4) X_WT.translation().z() -= 20e-3 * dt;
        removed += r.removed_mm3;
        cut = r.cutting;
        mean += (r.wrench.torque.z() - mean) / 100;
        square += (r.wrench.torque.z() - mean) * (r.wrench.torque.z() - mean);
      }
      std::printf(
          "%-12s %4.1f mm3 gone, %4.1f N mm at the spindle, teeth at %4.0f Hz; vibration %-3s: ripple %5.3f N mm\n",
          name, removed, 1e3 * cut.torque, tool.edges.flutes * cut.spindle / (2 * std::numbers::pi),
          share > 0 ? "on" : "off", 1e3 * std::sqrt(square / 5000));
    }
}
