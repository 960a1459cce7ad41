// SPDX-License-Identifier: MIT
#include <trephine/stage/wrench_rate_limit.hpp>

#include "fakes.hpp"
#include "support/near.hpp"

#include <random>

using namespace trephine;
using namespace trephine::test;

TEST_CASE("rate limit: a step becomes a slope of exactly the rate, then stands") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, WrenchRateLimit({.force = 200, .torque = 10}),
                           DeviceLimits{.force = 9, .torque = 9}};
  // 1 N and 2 N·m at once: .2 N and .01 N·m a tick.
  for (int k = 1; k <= 300; ++k) {
    const Wrenchd w = scene.tick({.X_WT = at(0, 0, -1e-3)}, kTick).wrench;
    CHECK(w.force.z() == near(std::min(1.0, 0.2 * k), 1e-12));
    CHECK(w.torque.x() == near(std::min(2.0, 0.01 * k), 1e-14));
  }
}

TEST_CASE("rate limit: the rate is one of time, not of ticks") {
  auto bone = small_grid();
  for (const double dt : {2.5e-4, 1e-3, 4e-3}) {
    auto scene = HapticScene{bone, 300, Floor<>{}, WrenchRateLimit({.force = 20}), DeviceLimits{.force = 9}};
    Wrenchd w;
    for (double t = 0; t < 0.02 - dt / 2; t += dt) w = scene.tick({.X_WT = at(0, 0, -1e-3)}, dt).wrench;
    CHECK(w.force.z() == near(0.4, 1e-14));
  }
}

TEST_CASE("rate limit: what is slow enough passes, to the bit") {
  auto bone = small_grid();
  auto with =
      HapticScene{bone, 300, Floor<>{}, WrenchRateLimit({.force = 600}), DeviceLimits{.force = 2, .torque = 0.2}};
  auto without = HapticScene{bone, 300, Floor<>{}, DeviceLimits{.force = 2, .torque = 0.2}};
  for (int k = 0; k < 2000; ++k) {
    const TickInput input{.X_WT = at(1e-3 * std::sin(0.02 * k), 0, -1e-3 * std::sin(0.01 * k))};
    CHECK(with.tick(input, kTick).wrench.force == without.tick(input, kTick).wrench.force);
  }
}

TEST_CASE("rate limit: no step after the limits is larger, and what was clipped need not be unwound") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, WrenchRateLimit({.force = 500, .torque = 5}),
                           DeviceLimits{.force = 3.3, .torque = 0.1}};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  Wrenchd before;
  for (int k = 0; k < 5000; ++k) {
    scene.renderer().overflow = k % 5 == 0 ? 1e3 * u(random) : u(random);
    const Wrenchd w = scene.tick({.X_WT = at(0, 0, 0.01 * u(random))}, kTick).wrench;
    REQUIRE((w.force - before.force).norm() <= 0.5 * (1 + 1e-12));
    REQUIRE((w.torque - before.torque).norm() <= 5e-3 * (1 + 1e-12));
    before = w;
  }
  // 1 kN held for a while, then nothing: gone as soon as 3.3 N are.
  scene.renderer().overflow = 0;
  for (int k = 0; k < 1000; ++k) (void)scene.tick({.X_WT = at(0, 0, -1)}, kTick);
  int ticks = 0;
  while (scene.tick({.X_WT = at(0, 0, 1)}, kTick).wrench.force.norm() > 0 && ticks < 100) ++ticks;
  CHECK(ticks == 6);  // .5 N a tick: 3.3 N is gone at the seventh
}

TEST_CASE("rate limit: comes back from zero after a tick that sent nothing, and goes on after a reset") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, WrenchRateLimit({.force = 200}), DeviceLimits{.force = 9}};
  const auto press = [&] { return scene.tick({.X_WT = at(0, 0, -1e-3)}, kTick).wrench.force.z(); };
  for (int k = 0; k < 10; ++k) (void)press();
  CHECK(press() == near(1));
  CHECK(scene.tick({.X_WT = at(kNaN, 0, 0)}, kTick).wrench == Wrenchd::zero());
  CHECK(press() == near(0.2));
  CHECK(press() == near(0.4));
  scene.reset();
  CHECK(std::abs(press() - 0.6) <= 1e-14);
}

TEST_CASE("rate limit: extremes and refusals") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, Add{0}, WrenchRateLimit({}), DeviceLimits{.force = 3}};
  for (const double newton : {1e200, -1e200, 1e308, 5e-324, kInf, kNaN, 0.0}) {
    scene.part<Add>().newton = newton;
    const TickResult r = scene.tick({.X_WT = at(0, 0, 1)}, kTick);
    CHECK(is_finite(r.wrench));
    CHECK(r.wrench.force.norm() <= 3);
    CHECK((r.status == Status::kNonFinite) == !std::isfinite(newton));
  }
  CHECK(refusal([] { WrenchRateLimit{{.force = 0}}; }) ==
        "trephine::WrenchRateLimit: force must be finite and > 0 N/s, got 0");
  for (const double bad : {-1.0, 0.0, kNaN, kInf}) {
    CHECK(!refusal([&] { WrenchRateLimit{{.force = bad}}; }).empty());
    CHECK(!refusal([&] { WrenchRateLimit{{.torque = bad}}; }).empty());
  }
}
