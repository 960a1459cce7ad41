// SPDX-License-Identifier: MIT
// The smallest complete host: which call belongs to which thread. README.md does the same for CHAI3D, H3D, SOFA, iMSTK.
#include "host.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <atomic>
#include <chrono>
#include <thread>

using namespace trephine;

/// W has the host's axes, in metres.
Posed to_trephine(const embed::HostPose& pose) {
  const auto& [p, q] = pose;
  return make_pose<double>(Mat3d(Quatd(q[3], q[0], q[1], q[2]).normalized()), 1e-3 * Vec3d(p[0], p[1], p[2]));
}

int main() {
  // Loading: bone below 12 mm, its CT's z axis upright in the host's world.
  const Posed X_WG = make_pose<double>(rotation_between<double>(Vec3d::UnitZ(), Vec3d::UnitY()), Vec3d(0, 0, 16_mm));
  VoxelGrid<std::int16_t> bone({{40, 32, 32}, {0.5_mm, 0.5_mm, 0.5_mm}, X_WG}, embed::read_volume());
  HapticScene scene{bone, 300, SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts{}}}, Cutting{},
                    DeviceLimits{.force = 3.3}};
  std::atomic<bool> drilling{true};
  std::atomic<float> force{0};  // what the user interface shows: small enough for an atomic, else a Mailbox
  double removed_mm3 = 0;

  // Haptic thread: ticks the scene and alone may touch `bone`. No lock, no memory, no file.
  std::thread haptic([&] {
    for (embed::HapticClock clock; clock.next();) {
      const Posed X_WT = to_trephine(embed::read_device(clock.t));
      const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = clock.t > 0.5}, clock.dt);
      // Here r.wrench goes to the device: newtons, newton metres, about the burr's centre, in W's axes.
      force.store(static_cast<float>(r.wrench.force.norm()));
      removed_mm3 += r.removed_mm3;
    }
    drilling = false;
  });

  // Mesh thread: a reader of its own names the bricks that changed. It never makes the haptic thread wait.
  embed::MeshStore mesh;
  std::thread mesher([&] {
    GridReader<std::int16_t> reader(bone);
    for (bool last = false; !last; std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
      last = !drilling;  // taken before the poll, so that the last poll sees the last edit
      reader.poll([&](std::size_t brick) { mesh.put(brick, brick_mesh(reader, brick, scene.isovalue())); });
    }
  });

  // Drawing thread: takes what is new at each picture. The vertices are in G: draw them with X_WG.
  for (int frame = 0; drilling; ++frame) embed::draw(mesh, force, frame);
  haptic.join();
  mesher.join();
  return embed::finish(mesh, bone, scene.isovalue(), removed_mm3) ? 0 : 1;
}
