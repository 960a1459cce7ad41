// SPDX-License-Identifier: MIT
// Spares a nerve of a segmentation: a guard pushes the tool out of a margin, and a veto keeps every cut out of another.
// See the push rise as the drill comes near, and the bone around the nerve stay however far the hand goes.
#include <trephine/structures.hpp>
#include <trephine/trephine.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main() {
  std::vector<std::int16_t> hounsfield(64 * 64 * 36, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.4_mm, 0.4_mm, 0.4_mm}}, hounsfield);

  std::vector<std::uint8_t> voxels;  // of the segmentation, which has a grid of its own: a tube along x
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 84; ++j)
      for (int i = 0; i < 84; ++i) voxels.push_back(std::hypot(0.3 * j - 12.6, 0.3 * k - 8.6) < 0.8 ? 1 : 0);
  const LabelGrid<std::uint8_t> labels({.size = {84, 84, 64}, .spacing = {0.3_mm, 0.3_mm, 0.3_mm}}, voxels,
                                       {{.label = 1, .name = "facial nerve"}});

  const Burr burr{.tip_radius = 1.5_mm};
  const std::vector<ProtectedStructure> spared{
      {.guard = {.margin = 1_mm, .stiffness = 500, .greatest_force = 1.5}, .veto = {.margin = 0.3_mm}}};
  const Protection protection{labels, bone, 300, burr, spared};
  HapticScene scene{bone, 300, CoupledToolRenderer{burr, CoupledOptions{.stiffness = 500}}, Cutting{}, protection};

  double removed = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    Posed X_WT = Posed::Identity();
    X_WT.translation() = Vec3d(12.6_mm, 12.6_mm, 16_mm - 4e-6 * tick);  // 4 mm/s toward the nerve, and into it
    const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = true}, 1e-3);
    removed += r.removed_mm3;
    if (tick % 250 == 249)
      std::printf("%5.2f mm to the %s: guard %.2f N, %4.1f mm3 cut, %4.1f mm3 refused\n", 1e3 * r.structures.distance,
                  labels.structures()[0].name.c_str(), r.structures.push.force.norm(), removed,
                  protection.cut_floor()->refused_mm3());
  }
}
