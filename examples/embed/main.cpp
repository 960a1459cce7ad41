// SPDX-License-Identifier: MIT
// The smallest complete host: its own loop, its own pose type, its own mesh that follows the drilling. It shows which
// call belongs to which thread; README.md in this folder does the same for CHAI3D, H3D, SOFA and iMSTK.
#include "brick_surface.hpp"

#include <trephine/core/units.hpp>
#include <trephine/render/surface_approx_renderer.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <mutex>
#include <numbers>
#include <thread>

using namespace trephine;
using namespace std::chrono_literals;

namespace {

/// The host's own pose: millimetres, y up, quaternion in single precision.
struct HostPose {
  std::array<float, 3> position_mm;
  std::array<float, 4> xyzw;
};

/// W has the host's axes, in metres.
Posed to_trephine(const HostPose& pose) {
  const auto& [p, q] = pose;
  return make_pose<double>(Quatd(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix(),
                           1e-3 * Vec3d(p[0], p[1], p[2]));
}

/// Stands for the device's driver: a hand that comes down on the bone, then drills. The shaft points up, along y.
HostPose read_device(double t) {
  return {{10, static_cast<float>(14.2 - 3.0 * t), 8}, {-0.70710678F, 0, 0, 0.70710678F}};
}

}  // namespace

int main() {
  // Loading: bone below 12 mm, its CT's z axis upright in the host's world.
  std::vector<std::int16_t> hounsfield(40 * 32 * 32, -1000);
  for (std::size_t i = 0; i < hounsfield.size() * 3 / 4; ++i) hounsfield[i] = 1200;
  const Posed X_WG(Eigen::Translation3d(0, 0, 16_mm) * Eigen::AngleAxisd(-std::numbers::pi / 2, Vec3d::UnitX()));
  VoxelGrid<std::int16_t> bone({{40, 32, 32}, {0.5_mm, 0.5_mm, 0.5_mm}, X_WG}, hounsfield);
  const double isovalue = 300;
  HapticScene scene{bone, isovalue, SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts{}}}, Milling{},
                    DeviceLimits{.force = 3.3}};

  std::atomic<bool> drilling{true};
  std::atomic<float> force{0};  // what the user interface shows: small enough for an atomic, else a Mailbox
  double removed_mm3 = 0;

  // Haptic thread: ticks the scene and alone may touch `bone`. No lock, no memory, no file.
  std::thread haptic([&] {
    const auto start = std::chrono::steady_clock::now();
    for (auto now = start, last = start; now - start < 1s; last = now) {
      std::this_thread::sleep_until(now + 1ms);
      now = std::chrono::steady_clock::now();
      const double t = std::chrono::duration<double>(now - start).count();
      const double dt = std::chrono::duration<double>(now - last).count();
      const TickResult r = scene.tick({.X_WT = to_trephine(read_device(t)), .spindle_on = t > 0.5}, dt);
      // Here r.wrench goes to the device: newtons, newton metres, about the burr's centre, in W's axes.
      force.store(static_cast<float>(r.wrench.force.norm()));
      removed_mm3 += r.removed_mm3;
    }
    drilling = false;
  });

  // Mesh thread: a reader of its own names the bricks that changed; only those are extracted anew. It never makes the
  // haptic thread wait. Its lock is between it and the drawing thread.
  std::mutex between;
  std::map<std::size_t, embed::BrickSurface> changed;
  std::thread mesher([&] {
    GridReader<std::int16_t> reader(bone);
    for (bool last = false; !last; std::this_thread::sleep_for(10ms)) {
      last = !drilling;  // taken before the poll, so that the last poll sees the last edit
      reader.poll([&](std::size_t brick) {
        auto surface = embed::extract_surface(reader, brick, isovalue);
        const std::lock_guard lock(between);
        changed[brick] = std::move(surface);
      });
    }
  });

  // Drawing thread: takes what is new at each picture. The vertices are in G: draw them with X_WG.
  std::map<std::size_t, embed::BrickSurface> mesh;
  std::size_t uploads = 0;
  const auto draw = [&] {
    std::map<std::size_t, embed::BrickSurface> fresh;
    {
      const std::lock_guard lock(between);
      fresh.swap(changed);
    }
    uploads += fresh.size();
    for (auto& [brick, surface] : fresh) mesh[brick] = std::move(surface);
  };
  for (int frame = 0; drilling; ++frame) {
    draw();
    if (frame % 15 == 0) std::printf("%4.2f N, %zu bricks uploaded\n", static_cast<double>(force), uploads);
    std::this_thread::sleep_for(16ms);
  }
  haptic.join();
  mesher.join();
  draw();

  // What was followed brick by brick is what is there.
  GridReader<std::int16_t> again(bone);
  std::size_t wrong = 0;
  again.poll([&](std::size_t brick) { wrong += embed::extract_surface(again, brick, isovalue) != mesh[brick]; });
  std::printf("removed %.1f mm3; uploaded %zu bricks once and %zu that changed; %zu differ from the bone\n",
              removed_mm3, mesh.size(), uploads - mesh.size(), wrong);
  return wrong == 0 && uploads > mesh.size() ? 0 : 1;
}
