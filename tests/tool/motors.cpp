// SPDX-License-Identifier: MIT
// Motors by name: the straight line of torque and speed, and what was measured on turbines.
#include "support/check_refused.hpp"
#include "support/near.hpp"

#include <trephine/tool/motors.hpp>

#include <doctest/doctest.h>

#include <numbers>

namespace {

using namespace trephine;
using namespace trephine::test;

TEST_CASE("motors: speed falls in a line, and power is largest at half the free speed, stall torque by speed over 4") {
  for (const NamedMotor& known : kMotors) {
    CAPTURE(known.name);
    const Motor m = motor_by_name(known.name);
    CHECK(m.speed_under(0) == m.speed);
    CHECK(m.speed_under(m.stall_torque) == 0);
    CHECK(m.speed_under(2 * m.stall_torque) == 0);
    CHECK(m.speed_under(-m.stall_torque) == m.speed);
    constexpr int n = 1000;
    int best = 0;
    for (int i = 0; i <= n; ++i) {
      const double torque = m.stall_torque * i / n;
      CHECK(m.speed_under(torque) == within(m.speed * (n - i) / n, 1e-12 * m.speed));
      if (m.power_under(torque) > m.power_under(m.stall_torque * best / n)) best = i;
    }
    const double at_best = m.stall_torque * best / n;
    CHECK(m.speed_under(at_best) == near(m.speed / 2));
    CHECK(m.power_under(at_best) == near(m.stall_torque * m.speed / 4));
  }
}

TEST_CASE("motors: the air turbine is the strongest of 41, by a power that was measured apart") {
  // Brockhurst and Shams 1994: up to 500 krpm, 2.33 N·mm and 29.6 W, the most at 49 to 79 % of the free speed.
  const Motor turbine = motor_by_name("air-turbine");
  CHECK(turbine.speed == near(rpm(500e3)));
  CHECK(turbine.stall_torque == near(2.33e-3));
  const double most = turbine.power_under(turbine.stall_torque / 2);
  MESSAGE("largest power ", most, " W of 29.6 W measured");
  CHECK(most == near(29.6, 0.035));
}

TEST_CASE("motors: a burr's drag slows a turbine as it does in ceramic, though by more") {
  // A coarse diamond in leucite ceramic (see kMotors): 322.2 krpm free, tangential .24 to 1.77 N, 10.5 % slower at
  // worst. The radius and the handpiece's stall torque are not stated: here a burr of 1 mm on the strongest turbine
  // of 41.
  constexpr double radius = 0.5e-3, least = 0.24, most = 1.77, measured = 0.105;
  Motor turbine = motor_by_name("air-turbine");
  turbine.speed = rpm(322.2e3);
  const auto droop = [&](double force) { return 1 - turbine.speed_under(force * radius) / turbine.speed; };
  const double stall = most * radius / measured;
  MESSAGE("droop ", 100 * droop(least), " to ", 100 * droop(most),
          " % where 10.5 % was measured at worst; 10.5 % takes ", 1e3 * stall, " N mm of stall torque, or a radius of ",
          1e3 * measured * turbine.stall_torque / most, " mm");
  CHECK(droop(least) < measured);
  CHECK(droop(most) > measured);
  CHECK(droop(most) < 4 * measured);
  CHECK(droop(most) / droop(least) == near(most / least));
}

TEST_CASE("motors: a rotor's inertia is that of its mass, and turbines run up within a second") {
  // ∫ r² dm over thin rings.
  constexpr double radius = 4e-3, length = 3e-3;
  constexpr int n = 2000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double r = radius * (i + 0.5) / n;
    sum += r * r * 7800 * length * 2 * std::numbers::pi * r * radius / n;
  }
  CHECK(rotor_inertia(radius, length) == near(sum, 1e-6));
  for (const NamedMotor& known : kMotors) {
    const double constant = known.motor.inertia * known.motor.speed / known.motor.stall_torque;
    MESSAGE(known.name, " runs up with a time constant of ", constant, " s");
    CHECK(constant > 0.01);
    CHECK(constant < 0.5);
  }
}

TEST_CASE("motors: other names are refused with all that there are") {
  CHECK(
      refusal([] { static_cast<void>(motor_by_name("turbine")); }) ==
      "trephine::motor_by_name: the name must be one of air-turbine, electric-handpiece, surgical-drill, got turbine");
  check_refused("got ", [] { static_cast<void>(motor_by_name("")); });
}

}  // namespace
