// SPDX-License-Identifier: MIT
#include <trephine/stage/damping.hpp>

#include "fakes.hpp"
#include "support/near.hpp"

#include <numbers>

using namespace trephine;
using namespace trephine::test;

TEST_CASE("damping opposes the twist, linear and angular apart") {
  const TickInput input;
  auto c = touching(input);
  c.twist = {Vec3d(0.1, -0.2, 0.3), Vec3d(1, 2, -3)};
  Wrenchd w{Vec3d(1, 1, 1), Vec3d::Zero()};
  Damping{{.linear = 2, .angular = 0.01}}.apply(c, w);
  CHECK((w.force - Vec3d(0.8, 1.4, 0.4)).norm() < 1e-15);
  CHECK((w.torque - Vec3d(-0.01, -0.02, 0.03)).norm() < 1e-15);
}

TEST_CASE("damping only in contact uses the velocity to the bone and nothing in the air") {
  const TickInput input;
  auto c = touching(input);
  c.twist = {Vec3d(1, 0, 0), Vec3d(1, 0, 0)};
  c.twist_to_bone = {Vec3d(0, 1, 0), Vec3d(0, 1, 0)};
  const Damping damping{{.linear = 2, .angular = 3, .only_in_contact = true}};
  Wrenchd w;
  damping.apply(c, w);
  CHECK(w == Wrenchd{Vec3d(0, -2, 0), Vec3d(0, -3, 0)});
  c.contact = {};
  w = {};
  damping.apply(c, w);
  CHECK(w == Wrenchd{});
}

TEST_CASE("the energy a damper takes from a sine motion is b A² ω² t / 2 · sinc²(ω dt / 2)") {
  // Backward differences of a sine have exactly this mean square over whole periods; force and step of one tick.
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, Damping{{.linear = 1.5}}};
  constexpr double kAmplitude = 5e-3;
  constexpr int kPeriods = 5;
  constexpr int kTicksPerPeriod = 40;  // 25 Hz at 1 kHz
  const double omega = 2 * std::numbers::pi / (kTicksPerPeriod * kTick);
  double work = 0;
  double before = 0;
  for (int k = 0; k <= kPeriods * kTicksPerPeriod; ++k) {
    const double x = kAmplitude * std::sin(omega * k * kTick);
    const TickResult r = scene.tick({.X_WT = at(x, 0, 1)}, kTick);
    work += r.wrench.force.x() * (x - before);
    before = x;
  }
  const double half = omega * kTick / 2;
  const double sinc = std::sin(half) / half;
  const double expected =
      -1.5 * kAmplitude * kAmplitude * omega * omega * (kPeriods * kTicksPerPeriod * kTick) / 2 * sinc * sinc;
  CHECK(work == near(expected, 1e-14));
}

TEST_CASE("on a free mass the damped loop is stable up to b = 2 m / dt, as documented") {
  constexpr double kMass = 0.045;
  const auto speed_after = [](double b) {
    auto bone = small_grid();
    auto scene = HapticScene{bone, 300, Floor<>{}, Damping{{.linear = b}}};
    double x = 0;
    double v = 0.01;
    (void)scene.tick({.X_WT = at(x, 0, 1)}, kTick);
    for (int k = 0; k < 400; ++k) {  // exact motion under a force held for a tick
      const double a = scene.tick({.X_WT = at(x, 0, 1)}, kTick).wrench.force.x() / kMass;
      x += v * kTick + a * kTick * kTick / 2;
      v += a * kTick;
    }
    return std::abs(v);
  };
  CHECK(speed_after(0.95 * 2 * kMass / kTick) < 1e-3);
  CHECK(speed_after(1.05 * 2 * kMass / kTick) > 0.1);
}

TEST_CASE("damping refuses what is no damping") {
  CHECK(refusal([] { Damping{{.linear = -1}}; }) == "trephine::Damping: linear must be finite and >= 0 N·s/m, got -1");
  CHECK(refusal([] { Damping{{.linear = kNaN}}; }).find("linear") != std::string::npos);
  CHECK(refusal([] { Damping{{.angular = kInf}}; }).find("angular") != std::string::npos);
  CHECK(refusal([] { Damping{{.angular = kNaN}}; }).find("angular") != std::string::npos);
  CHECK(refusal([] { Damping{{}}; }).empty());
}
