// SPDX-License-Identifier: MIT
// Where bone gives way, and what the coupling then lets go.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"

#include <trephine/voxel/carving.hpp>

#include <trephine/core/rotation.hpp>

#include <doctest/doctest.h>

#include <cmath>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 733;

// Bone vanishes from under a tool that a device at rest holds pressed. The force has to fall at `release`, at any tick
// rate, and the drawn tool to follow at its own speed.
TEST_CASE("release: where bone gives way the force falls with the stated slope, at any tick rate") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  Figures duration, step, drawn, drawn_duration;
  for (const double dt : {1e-3, 2.5e-4, 4e-3})
    for (const double release : {60.0, 200.0})
      for (int n = 0; n < cases(6); ++n) {
        const ImageOptions o{.sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1.0};
        const Vec3d up = random.unit(), top = o.near_middle(random), axis = (up + 0.6 * random.unit()).normalized();
        Bone bone = image(HalfSpace{top, up}, o);
        CoupledOptions gains = kGains;
        gains.release = release;
        auto scene = coupled_scene(bone, n % 2 == 0 ? kBall : kDrill, Frictionless{}, gains);
        const auto at = [&](double depth) { return tool_at(top + (kBall.tip_radius - depth) * up, axis); };
        const Posed X = at(random.uniform(1e-3, 3e-3));
        const double force = lead(scene, at(-2e-4), X, 200).wrench.force.norm();
        REQUIRE(force > 0.7);
        const double extension = (scene.visual_pose_W().translation() - X.translation()).norm();
        REQUIRE(carve(bone, kIso, SphereCutter(X.translation(), X.translation(), 0.006)) > 0);
        double last = force, behind = extension;
        int ticks = 0, drawn_ticks = 0;
        for (int i = 0; i < 2000 && (last > 0 || behind > 0); ++i) {
          const TickResult r = scene.tick({.X_WT = X}, dt);
          CHECK(r.status == Status::kOk);
          CHECK(r.contact.count == 0);
          const double now = r.wrench.force.norm();
          const double now_behind = (scene.visual_pose_W().translation() - X.translation()).norm();
          if (now > 0) step.add(std::abs((last - now) / (release * dt) - 1));
          if (now_behind > 1e-9) drawn.add(std::abs((behind - now_behind) / (CoupledConstants::kDrawnSpeed * dt) - 1));
          ticks += last > 0 ? 1 : 0;
          drawn_ticks += behind > 0 ? 1 : 0;
          last = now;
          behind = now_behind;
        }
        duration.add(std::abs(ticks * dt - force / release) / dt);
        drawn_duration.add(std::abs(drawn_ticks * dt - extension / CoupledConstants::kDrawnSpeed) / dt);
      }
  MESSAGE("slope's error ", step, ", drawn tool's ", drawn, "; durations off in ticks ", duration, "; ",
          drawn_duration);
  CHECK(step.worst() <= 1.1e-13);
  CHECK(drawn.worst() <= 8.5e-14);
  CHECK(duration.worst() <= 1);
  CHECK(drawn_duration.worst() <= 1);
}

TEST_CASE("release: in bone that is turned the bound counts the same motion") {
  CoupledOptions gains = kGains;
  gains.release = 60;
  const Vec3d at = ImageOptions{}.middle(), up = Vec3d::UnitZ();
  const Posed X_WG = make_pose<double>(rotation_from_vector(Vec3d(1.1, -0.7, 2)), Vec3d(0.1, -0.2, 0.3));
  Bone bone = image(HalfSpace{at, up}, {}), turned = image(HalfSpace{at, up}, {});
  turned.set_X_WG(X_WG);
  auto scene = coupled_scene(bone, kBall, Frictionless{}, gains);
  auto other = coupled_scene(turned, kBall, Frictionless{}, gains);
  double most = 0, off = 0;
  for (int i = 0; i < 40; ++i) {  // in and out by 0.3 mm a tick, far faster than the bound's slope
    const Posed X = tool_at(at + (kBall.tip_radius + 3e-4 * (std::abs(i - 20) - 12)) * up, up);
    const Vec3d force = scene.tick({.X_WT = X}, kDt).wrench.force;
    off = std::max(off, (other.tick({.X_WT = X_WG * X}, kDt).wrench.force - X_WG.linear() * force).norm());
    most = std::max(most, force.norm());
  }
  CHECK(most > 1.5);
  CHECK(off < 1e-6);
}

TEST_CASE("release: a hand that draws back, or slides, feels the same without the bound") {
  CAPTURE(kSeed);
  Random random(kSeed + 2);
  for (int n = 0; n < cases(12); ++n) {
    const ImageOptions o{.sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1.0};
    const Vec3d up = random.unit(), top = o.near_middle(random);
    Bone bone = image(HalfSpace{top, up}, o);
    CoupledOptions bounded = kGains;
    bounded.release = CoupledOptions{}.release;
    auto scene = coupled_scene(bone, kDrill, Frictionless{}, bounded), other = coupled_scene(bone, kDrill);
    const double speed = std::pow(10, random.uniform(-2, 0));
    const Vec3d way = speed * kDt * random.unit();
    double z = -1e-4;
    for (int i = 0; i < 100; ++i) {
      z = i < 50 ? std::min(z + 5e-5, 2e-3) : z - speed * kDt;  // in, then out by `speed`
      const Posed X = tool_at(top + (kDrill.tip_radius - z) * up + std::min(i, 10) * 1e-2 * way, up);
      const TickResult a = scene.tick({.X_WT = X}, kDt), b = other.tick({.X_WT = X}, kDt);
      CHECK(a.wrench == b.wrench);
    }
  }
}

}  // namespace
