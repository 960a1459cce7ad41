// SPDX-License-Identifier: MIT
// Bone that appears round the tool: a start in it, and `restore()` with the tool in its hole. Every renderer says
// kStartedInside with the first wrench, and the servo loop brings that in by a ramp.
#include "device/archetypes.hpp"
#include "integration/scenes.hpp"
#include "support/random.hpp"

#include <doctest/doctest.h>

#include <chrono>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kMiddle = 0.5 * kBlockSize * kVoxel;
constexpr double kRamp = 0.1;  // [s]

template <class F>
void for_each_renderer(F&& f) {
  f(make_line<float>());
  f(make_thesis_line<float>());
  f(make_surface<float>());
  f(make_thesis_surface<float>());
  f(SurfaceApproxRenderer{ToolDiscretization{kDrill, SurfaceCounts{}}});
  f(make_coupled());
}

/// Upright, its lowest point `depth` below the block's surface.
Posed pressed(double x, double y, double depth) {
  return make_pose<double>(Mat3d::Identity(), Vec3d(x, y, kSurfaceHeight + kDrill.tip_radius - depth));
}

}  // namespace

TEST_CASE("a scene that starts in bone says so with its first wrench, then no more") {
  Random random(801);
  int felt = 0;
  for (int place = 0; place < 8; ++place) {
    const double x = kMiddle + 1e-3 * random.uniform(-1, 1);
    const double y = kMiddle + 1e-3 * random.uniform(-1, 1);
    const double depth = 0.1e-3 + 0.2e-3 * place;  // up to 1.5 mm
    for_each_renderer([&](auto renderer) {
      auto bone = make_block<std::uint8_t>();
      HapticScene scene{bone, kIsovalue, renderer};
      const TickInput input{.X_WT = pressed(x, y, depth)};
      TickResult r = scene.tick(input, 1e-3);
      if (r.wrench == Wrenchd::zero()) return;  // the line's tip is the ball's centre
      ++felt;
      CHECK(r.status == Status::kStartedInside);
      for (int i = 0; i < 20; ++i) r = scene.tick(input, 1e-3);
      CHECK(r.status == Status::kOk);
      const Wrenchd held = r.wrench;
      scene.reset();
      r = scene.tick(input, 1e-3);
      CHECK(r.status == Status::kStartedInside);
      CHECK(held.force.norm() > 0);
    });
  }
  CHECK(felt >= 3 * 8);  // Surface and the coupled tool
}

TEST_CASE("bone that is restored round the tool is brought in by a ramp") {
  Random random(802);
  double worst = 0, most = 0;
  for (int place = 0; place < 7; ++place) {
    const double x = kMiddle + 1e-3 * random.uniform(-1, 1);
    const double y = kMiddle + 1e-3 * random.uniform(-1, 1);
    // 0.5 to 3 mm: the ball, then the shaft in its hole. Last a hole through the block, with the ball beyond it.
    const double depth = place < 6 ? 0.5e-3 + 0.5e-3 * place : 16e-3;
    const double lean = place < 6 ? 0.02 * place : 0;
    for_each_renderer([&](auto renderer) {
      auto bone = make_block<std::uint8_t>();
      HapticScene scene{bone, kIsovalue, renderer, DeviceLimits{.force = 3.3, .torque = 0.1}};
      // A hole, a little wider than the drill, in which it hangs and sways by 0.05 mm.
      Burr wide = kDrill;
      wide.tip_radius += 0.4e-3;
      Cutting<> mill;
      for (double d = 0; d < depth + 0.4e-3; d += 0.1e-3)
        (void)mill.carve(bone, kIsovalue, pressed(x, y, d - 0.1e-3), pressed(x, y, d), wide, {.dt = 1e-3});
      ScriptedDevice device([&](int n) {
        Moment now;
        now.X_DH = pressed(x + 0.05e-3 * std::sin(0.05 * n), y, depth);
        now.X_DH.linear() = rotation_from_vector<double>(Vec3d(0, lean, 0));
        return now;
      });
      ServoLoop loop(device, scene, Registration{}, {.rate = 1000, .ramp = kRamp}, NoPacing{});
      double before = 0, rise = 0, force = 0;
      int flagged = 0;
      (void)loop.run_for(std::chrono::milliseconds(1000), [&](const TickRecord& t) {
        if (t.index == 499) bone.restore();
        const double now = t.sent.force.norm();
        if (t.index >= 500) {
          rise = std::max(rise, now - before);
          force = std::max(force, now);
          flagged += needs_ramp(t.result.status) ? 1 : 0;
        }
        before = now;
      });
      worst = std::max(worst, rise);
      most = std::max(most, force);
      if (force > 0.01) CHECK(flagged > 0);
      // By the scene's own bound, or of 3.3 N a hundredth a tick by the loop's ramp; and what the sway adds: 0.05 mm in
      // 31 ticks against at most 4 N/mm.
      const double slope = scene.bounds_wrench() ? CoupledOptions{}.release * 1e-3 : 3.3 / 100;
      CHECK(rise < slope + 0.01);
    });
  }
  MESSAGE("restored: up to ", most, " N, by at most ", worst, " N a tick");
  CHECK(most > 1);
}
