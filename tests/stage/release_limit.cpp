// SPDX-License-Identifier: MIT
#include <trephine/core/rotation.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/release_limit.hpp>

#include "fakes.hpp"
#include "support/cases.hpp"
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"

using namespace trephine;
using namespace trephine::test;

TEST_CASE("release limit: a force falls and rises along the stated slope, at any tick rate") {
  auto bone = small_grid();
  for (const double dt : {2.5e-4, 1e-3, 4e-3}) {
    HapticScene scene{bone, 300, Floor<>{}, ReleaseLimit({.stiffness = 500, .release = 80})};
    const TickInput held{.X_WT = at(0, 0, 1e-3)};
    const auto force = [&](double wanted) {
      scene.renderer().overflow = wanted;
      return scene.tick(held, dt).wrench.force.x();
    };
    constexpr double kRounding = 1e-12;
    for (int again = 0; again < 2; ++again) {
      for (int i = 1; i * dt < 0.03; ++i) CHECK(std::abs(force(2) - std::min(2.0, 80 * i * dt)) <= kRounding);
      CHECK(force(2) == 2);
      for (int i = 1; i * dt < 0.03; ++i) CHECK(std::abs(force(0) - std::max(0.0, 2 - 80 * i * dt)) <= kRounding);
    }
    // A new start, a reset and a jump go on from the wrench that acts; a tick that sent zero has the next from zero.
    for (int i = 0; i * dt < 0.03; ++i) force(2);
    scene.renderer().status = Status::kStartedInside;
    CHECK(std::abs(force(0) - (2 - 80 * dt)) <= kRounding);
    scene.renderer().status = Status::kOk;
    scene.reset();
    CHECK(std::abs(force(0) - (2 - 160 * dt)) <= kRounding);
    scene.renderer().overflow = 2;
    CHECK(scene.tick({.X_WT = at(0, 0, kNaN)}, dt).wrench == Wrenchd::zero());
    CHECK(std::abs(force(2) - 80 * dt) <= kRounding);
  }
}

TEST_CASE("release limit: force and torque fall together, and the springs' energy falls with them") {
  auto bone = small_grid();
  const ReleaseLimit::Options o{.stiffness = 800, .rotational_stiffness = 0.2, .release = 100};
  HapticScene scene{bone, 300, Floor<>{}, ReleaseLimit(o)};
  const TickInput held{.X_WT = at(0, 0, 1e-3)};
  scene.renderer().overflow = 1;
  scene.renderer().torque_overflow = 0.03;
  for (int i = 0; i < 30; ++i) static_cast<void>(scene.tick(held, kTick));
  Wrenchd before = scene.tick(held, kTick).wrench;
  CHECK(before.force.x() == 1);
  scene.renderer().overflow = scene.renderer().torque_overflow = 0;
  const auto twice_energy = [&](const Wrenchd& w) {
    return w.force.squaredNorm() / o.stiffness + w.torque.squaredNorm() / o.rotational_stiffness;
  };
  int ticks = 0;
  for (; before.force.x() > 0 && ticks < 100; ++ticks) {
    const Wrenchd now = scene.tick(held, kTick).wrench;
    CHECK(now.torque.y() == within(0.03 * now.force.x(), 1e-5 * 1e-3));
    CHECK(std::sqrt(twice_energy(before) * o.stiffness) - std::sqrt(twice_energy(now) * o.stiffness) <=
          o.release * kTick * (1 + 1e-9));
    before = now;
  }
  // √(1² + 800/0.2 · 0.03²) = 2.14 N at 0.1 N a tick.
  CHECK(ticks == 22);
}

TEST_CASE("release limit: what the device's own motion explains passes, to the bit") {
  auto bone = small_grid();
  // The floor's torque of twice the force has a lever of 2 m: here it counts for nothing.
  HapticScene with{bone, 300, Floor<>{.k = 800}, ReleaseLimit({.rotational_stiffness = 1e9})};
  HapticScene without{bone, 300, Floor<>{.k = 800}};
  // In and out by up to 0.3 m/s.
  for (int i = 0; i < 3000; ++i) {
    const double t = 1e-3 * i;
    const TickInput input{.X_WT = at(1e-3 * std::sin(40 * t), 0, 3e-3 * std::sin(100 * t))};
    CHECK(with.tick(input, kTick).wrench == without.tick(input, kTick).wrench);
  }
}

TEST_CASE("release limit: bone that moves away and turns counts as the tool's motion") {
  auto bone = small_grid();
  auto other = small_grid();
  HapticScene with{bone, 300, Floor<>{.k = 800}, ReleaseLimit({.rotational_stiffness = 1e9})};
  HapticScene without{other, 300, Floor<>{.k = 800}};
  for (int i = 0; i < 500; ++i) {
    const double t = 1e-3 * i;
    const Posed X_WG =
        make_pose<double>(rotation_from_vector(Vec3d(0, 0, 2 * t)), Vec3d(0, 0, 3e-3 * std::sin(60 * t)));
    bone.set_X_WG(X_WG);
    other.set_X_WG(X_WG);
    const TickInput input{.X_WT = at(0, 0, 0)};
    CHECK(with.tick(input, kTick).wrench == without.tick(input, kTick).wrench);
  }
  // Still bone, and a force that vanishes: along the world's axes.
  with.renderer().overflow = 2;
  for (int i = 0; i < 50; ++i) static_cast<void>(with.tick({.X_WT = at(0, 0, 1)}, kTick));
  const Vec3d full = with.tick({.X_WT = at(0, 0, 1)}, kTick).wrench.force;
  CHECK(std::abs(full.norm() - 2) <= 1e-14);
  with.renderer().overflow = 0;
  const Vec3d after = with.tick({.X_WT = at(0, 0, 1)}, kTick).wrench.force;
  CHECK((after - (1 - ReleaseLimit::Options{}.release * kTick / 2) * full).norm() <= 1e-12);
}

TEST_CASE("release limit: a wrench beyond all reason is no fault of its own") {
  auto bone = small_grid();
  HapticScene scene{bone, 300, Floor<>{}, ReleaseLimit{}, DeviceLimits{.force = 3, .torque = 0.1}};
  for (const double huge : {1e150, 1e200, 1e300}) {
    scene.renderer().overflow = huge;
    CHECK(scene.tick({.X_WT = at(0, 0, 1)}, kTick).wrench.force.norm() <=
          ReleaseLimit::Options{}.release * kTick * (1 + 1e-9));
    scene.renderer().overflow = 0;
    const TickResult r = scene.tick({.X_WT = at(0, 0, 1)}, kTick);
    CHECK(r.status == Status::kOk);
    CHECK(is_finite(r.wrench));
    scene.reset();
  }
}

// A hand goes in and out of a floor that vanishes now and then, and comes back while the hand is out.
TEST_CASE("release limit: no energy comes of it, if its stiffness is no less than the contact's") {
  for (const double k : {200.0, 800.0, 3000.0}) {
    auto bone = small_grid();
    HapticScene scene{bone, 300, Floor<>{.k = 800}, ReleaseLimit({.stiffness = k, .rotational_stiffness = 1e9})};
    Random random(17);
    double work = 0, turned_over = 0, z_before = 1e-3, force_before = 0;
    for (int n = 0; n < cases(400); ++n) {
      const double depth = 2e-3 * random.uniform(), speed = std::pow(10, random.uniform(-5, -3.5));  // [m] a tick
      // Below its true stiffness the limit holds on to a firm floor too.
      const double goes_at = k >= 800 && random.uniform() < 0.5 ? random.uniform(-depth, 1e-3) : -1;
      scene.renderer().k = 800;
      for (const double direction : {-1.0, 1.0})
        for (double z = z_before; direction * (direction < 0 ? -depth : 1e-3) > direction * z;) {
          z += direction * speed;
          if (z < goes_at) scene.renderer().k = 0;
          const double force = scene.tick({.X_WT = at(0, 0, z)}, kTick).wrench.force.z();
          const double part = 0.5 * (force + force_before) * (z - z_before);
          work += part;
          turned_over += std::abs(part);
          force_before = force;
          z_before = z;
        }
    }
    CAPTURE(k);
    MESSAGE("work on the hand ", work, " J of ", turned_over, " J with ", k, " N/m");
    CHECK(turned_over > 1e-3);
    if (k >= 800)
      CHECK(work <= 1e-3 * turned_over);
    else
      CHECK(work > 1e-3 * turned_over);
  }
}

TEST_CASE("release limit: refuses what is no stiffness and no rate") {
  for (const double bad : {0.0, -1.0, kNaN, kInf}) {
    CHECK_THROWS_AS(ReleaseLimit({.stiffness = bad}), std::invalid_argument);
    CHECK_THROWS_AS(ReleaseLimit({.rotational_stiffness = bad}), std::invalid_argument);
    CHECK_THROWS_AS(ReleaseLimit({.release = bad}), std::invalid_argument);
  }
}

// A point tip 0.8 mm deep drops its whole force as it passes an edge of 90°.
TEST_CASE("release limit: Line slides off an edge along a slope instead of a step") {
  constexpr double kDepth = 8e-4, kStep = 5e-5;
  Random random(91);
  Figures with, without;
  for (int n = 0; n < cases(18); ++n) {
    RasterOptions o{.size = {48, 48, 48}, .spacing = Vec3d::Constant(3e-4)};
    o.blur = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1.0;
    const Vec3d middle = Vec3d::Constant(23.5 * 3e-4) + random.arrow(0, 3e-4);
    const Vec3d up = random.unit(), out = up.unitOrthogonal();
    // Bone lies below the plane, on this side of the edge.
    auto bone = rasterise<std::int16_t>(Both{HalfSpace{middle, up}, HalfSpace{middle, out}}, o);
    const auto greatest_step = [&](auto& scene) {
      double most = 0, before = 0;
      const auto tick = [&](double along, double depth) {
        const Vec3d p = middle + along * out - depth * up;
        const double now = scene.tick({.X_WT = tool_at(p, up)}, kTick).wrench.force.norm();
        most = std::max(most, std::abs(now - before));
        before = now;
      };
      for (double depth = -1e-3; depth < kDepth; depth += 2e-5) tick(-3e-3, depth);
      most = 0;
      for (double along = -3e-3; along < 3e-3; along += kStep) tick(along, kDepth);
      CHECK(before == 0);
      return most;
    };
    const LineApproxRenderer line{ToolDiscretization{Burr{.shaft_length = 0}, LineCounts{}}, LineOptions{}};
    HapticScene plain{bone, o.isovalue(), line};
    HapticScene limited{bone, o.isovalue(), line, ReleaseLimit{}};
    without.add(greatest_step(plain));
    with.add(greatest_step(limited));
  }
  MESSAGE("greatest step [N]: ", without, "; with the limit ", with);
  CHECK(without.median() > 0.3);
  constexpr ReleaseLimit::Options kDefaults;
  CHECK(with.worst() <= kDefaults.stiffness * kStep + kDefaults.release * kTick + 1e-9);
}
