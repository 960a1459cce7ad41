// SPDX-License-Identifier: MIT
// Draws the bone: a mesh of each brick of 8 x 8 x 8 voxels that changed, and an STL file of what is left.
//   05_draw_the_bone [FILE.stl]
// See how few bricks a cut changes: a picture of 60 Hz makes those anew, on a thread of its own (examples/embed).
#include <trephine/trephine.hpp>
#include <trephine/voxel/brick_mesh.hpp>
#include <trephine/voxel/mesh_file.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <vector>

using namespace trephine;

int main(int argc, char** argv) {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);
  HapticScene scene{bone, 300, CoupledToolRenderer{Burr{.tip_radius = 2_mm}, CoupledOptions{}}, Cutting{}};

  GridReader<std::int16_t> reader(bone);  // any thread; the haptic thread never waits for it
  std::map<std::size_t, Mesh> drawn;
  for (int tick = 0; tick <= 2000; ++tick) {
    Posed X_WT = Posed::Identity();
    X_WT.translation() = Vec3d(8_mm + 8e-6 * tick, 16_mm, 12_mm);  // a groove along x, at 8 mm/s
    (void)scene.tick({.X_WT = X_WT, .spindle_on = true}, 1e-3);
    if (tick % 400 != 0) continue;
    const std::size_t changed = reader.poll([&](std::size_t brick) { drawn[brick] = brick_mesh(reader, brick, 300); });
    std::size_t triangles = 0;
    for (const auto& [brick, mesh] : drawn) triangles += mesh.triangles.size();
    std::printf("%.1f s: %3zu of %zu bricks drawn anew, %zu triangles in all\n", 1e-3 * tick, changed, drawn.size(),
                triangles);
  }
  const char* path = argc > 1 ? argv[1] : "drilled.stl";
  const Mesh mesh = bone_mesh(bone, 300);
  save_stl(path, mesh, bone.X_WG());  // in millimetres; save_ply writes vertices once
  std::printf("%s: %zu triangles\n", path, mesh.triangles.size());
}
