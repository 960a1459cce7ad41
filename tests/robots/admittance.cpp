// SPDX-License-Identifier: MIT
#include "admittance.hpp"

#include "robot.hpp"
#include "support/check_refused.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/tool/shape.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>

using namespace robots;
using namespace trephine::test;

namespace {

Wrenchd push(const Vec3d& f, const Vec3d& t = Vec3d::Zero()) { return {f, t}; }

}  // namespace

TEST_CASE("Admittance: a steady force gives G (|f| - b), at most its speed, at every rate") {
  const Vec3d u = Vec3d(1, 2, -2) / 3;
  for (const double dt : {0.25e-3, 1e-3, 4e-3}) {
    Admittance law({.gain = 0.01, .turn_gain = 3, .dead_band = 0.5, .turn_dead_band = 0.02, .speed = 0.08});
    const auto steady = [&](double force, double torque) {
      Twist v;
      for (double t = 0; t < 1; t += dt) v = law.twist(push(force * u, torque * u), dt);
      return v;
    };
    CHECK(steady(0.49, 0.019).linear == Vec3d::Zero());
    CHECK(steady(0.49, 0.019).angular == Vec3d::Zero());
    CHECK((steady(4, 0.1).linear - 0.035 * u).norm() < 1e-12);
    CHECK((steady(4, 0.1).angular - 0.24 * u).norm() < 1e-12);
    CHECK((steady(1000, 100).linear - 0.08 * u).norm() < 1e-12);
    CHECK((steady(1000, 100).angular - u).norm() < 1e-12);
  }
}

TEST_CASE("Admittance: a step of force is followed by the filter's exponential, and a restart rises from rest") {
  constexpr double kDt = 1e-3, kForce = 6;
  const AdmittanceOptions options{.gain = 0.01, .cutoff = 8, .dead_band = 0.5, .speed = 1, .ramp = 0.1};
  Admittance law(options);
  const auto truth = [&](int ticks) {
    const double f = kForce * (1 - std::exp(-2 * std::numbers::pi * options.cutoff * kDt * ticks));
    return std::min(kDt * ticks / options.ramp, 1.0) * options.gain * std::max(f - options.dead_band, 0.0);
  };
  for (const int run : {0, 1}) {
    CAPTURE(run);
    for (int tick = 1; tick <= 300; ++tick)
      CHECK(law.twist(push(Vec3d(0, kForce, 0)), kDt).linear.y() == within(truth(tick), 1e-12));
    law.restart();
  }
}

TEST_CASE("Admittance: noise of 48 mN does not move the tool") {
  SimulatedRobot robot(Posed::Identity());
  Admittance law;
  double squares = 0, fastest = 0;
  constexpr int kTicks = 200'000;
  for (int tick = 0; tick < kTicks; ++tick) {
    const Wrenchd measured = wrench(robot.advance({}, false, 1e-3).measured_cf);
    squares += measured.force.squaredNorm() / 3;
    const Twist v = law.twist(measured, 1e-3);
    fastest = std::max({fastest, v.linear.norm(), v.angular.norm()});
  }
  CHECK(std::sqrt(squares / kTicks) == near(0.048, 0.01));
  CHECK(fastest == 0);
}

TEST_CASE("Admittance: bad input is no force, and the next good one goes on") {
  Admittance law({.ramp = 1e-3});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e308, -1e308})
    for (int tick = 0; tick < 3; ++tick) {
      const Twist v = law.twist(push(Vec3d(bad, 0, bad), Vec3d(0, bad, 0)), bad);
      CHECK(is_finite(v.linear));
      CHECK(v.linear.norm() <= 0.03 * (1 + 1e-12));
    }
  Twist v;
  for (int tick = 0; tick < 100'000; ++tick) v = law.twist(push(Vec3d(4.2, 0, 0)), 1e-3);
  CHECK(v.linear.x() == near(0.02, 1e-6));
  check_refused("gain must be", [] { Admittance({.gain = 0}); });
  check_refused("ramp must be", [] { Admittance({.ramp = -1}); });
  check_refused("dead_band must be", [] { Admittance({.dead_band = -1}); });
}

TEST_CASE("SimulatedRobot: it trails commands within the barrier's speed by less than the barrier's lag") {
  const MotionBarrierOptions barrier;
  const Burr tool{.tip_radius = 1e-3, .shaft_radius = 0.6e-3, .shaft_length = 25e-3};
  Random random(11);
  double worst = 0;
  Posed X = Posed::Identity();
  SimulatedRobot robot(X);
  Twist v{Vec3d(1, 0, 0), Vec3d::Zero()};
  int left = 0;
  for (int tick = 0; tick < 200'000; ++tick) {
    if (--left < 0) {  // full speed any way, or back
      v = random.below(2) == 0 ? Twist{-v.linear, -v.angular} : Twist{random.arrow(0, 1), random.arrow(0, 100)};
      const double fastest =
          std::max(largest_speed(tool, z_axis(X), v) / barrier.speed, v.angular.norm() / 1 /* rad/s */);
      v = {v.linear / fastest, v.angular / fastest};
      left = random.below(random.below(2) == 0 ? 10 : 200);
    }
    X = pose_after(X, v, 1e-3);
    Command c;
    c.operating_state = OperatingState::kEnabled;
    c.servo_cp = position(X);
    (void)robot.advance({}, false, 1e-3);
    robot.command(c);
    worst = std::max(worst, largest_displacement(tool, X, robot.X_WT()));
  }
  std::cout << "trails by " << worst << " m\n";
  CHECK(worst <= barrier.speed * barrier.lag);
  CHECK(worst > 0.5 * barrier.speed * barrier.lag);  // the lag is not idle
}

TEST_CASE("SimulatedRobot: without commands, or told to pause, it stands") {
  for (const bool pauses : {false, true}) {
    SimulatedRobot robot(Posed::Identity());
    Command c;
    c.operating_state = OperatingState::kEnabled;
    for (int tick = 0; tick < 300; ++tick) {
      c.servo_cp.position[0] = 50e-6 * tick;
      (void)robot.advance({}, false, 1e-3);
      robot.command(c);
    }
    CHECK(robot.twist().linear.x() == near(0.05, 0.01));
    c.operating_state = OperatingState::kPaused;
    if (pauses) robot.command(c);
    // 10 ms of silence, and 10 ms to brake from 50 mm/s by 5 m/s².
    for (int tick = 0; tick < (pauses ? 11 : 21); ++tick) (void)robot.advance({}, false, 1e-3);
    CHECK(robot.twist().linear.isZero());
  }
}
