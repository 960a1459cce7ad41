// SPDX-License-Identifier: MIT
// Motors that drive a burr in bone: how they slow under its load, and where they stall.
#include "pushed_cut.hpp"
#include "support/check_refused.hpp"
#include "support/near.hpp"

#include <trephine/stage/driven_by.hpp>
#include <trephine/tool/motors.hpp>

#include <doctest/doctest.h>

#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::cutting;

/// A burr of 2 mm in material 16 times as strong as cortical bone, so that feeds last, under a push whose torque is
/// about `load` times the stall torque: torque by thrust is 0.8 mm where the burr's whole front cuts.
PushedCut<CuttingForce> driven_cut(const Motor& motor, double load) {
  const CuttingForceOptions options{.edges = {.flutes = 8}, .strength = {.cortical = 425, .most = 16}};
  return {{.layers = {{7e-3, 1700}}},
          long_round(1e-3),
          CuttingForce(driven_by(options, motor)),
          {.force = load * motor.stall_torque / 0.8e-3, .fastest = 20e-3}};
}

TEST_CASE("motors in bone: the spindle turns at the speed of the motor's line under the torque") {
  for (const NamedMotor& known : kMotors) {
    CAPTURE(known.name);
    const Motor& motor = known.motor;
    PushedCut cut = driven_cut(motor, 0.4);
    cut.go(1.2e-3);
    constexpr int kTicks = 200;
    double torque = 0, spindle = 0;
    for (int i = 0; i < kTicks; ++i) {
      static_cast<void>(cut.tick(1e-3));
      torque += cut.report().torque / kTicks;
      spindle += cut.report().spindle / kTicks;
    }
    MESSAGE(known.name, " under ", 1e3 * torque, " N mm: ", spindle / rpm(1), " rpm, ",
            100 * (1 - spindle / motor.speed), " % slower");
    CHECK(cut.status() == Status::kOk);
    CHECK(torque > 0.25 * motor.stall_torque);
    CHECK(spindle == near(motor.speed_under(torque), 0.01));
  }
}

TEST_CASE("motors in bone: a push whose torque no motor has stalls it, and the feed ends") {
  for (const NamedMotor& known : kMotors) {
    CAPTURE(known.name);
    PushedCut cut = driven_cut(known.motor, 1.5);
    double removed = 0;
    int stalled = 0;
    for (int i = 0; i < 6000 && stalled < 500; ++i) {
      const TickResult r = cut.tick(1e-3);
      if (cut.report().spindle > 0) continue;
      CHECK(cut.report().torque <= known.motor.stall_torque * (1 + 1e-9));
      if (stalled++ == 0) continue;  // the tick in which it stops may cut
      CHECK(cut.report().feed == 0);
      removed += r.removed_mm3;
    }
    MESSAGE(known.name, " stalled at a depth of ", 1e3 * cut.tip(), " mm");
    CHECK(stalled == 500);
    CHECK(removed < 1e-4);  // what the law still owed [mm³]
    CHECK(cut.tip() > 0.2e-3);
    CHECK(cut.status() == Status::kOk);
  }
}

TEST_CASE("motors in bone: a spindle refuses a motor that does not turn") {
  const auto drive = [](const Motor& motor) { driven_by({}, motor).validate(); };
  constexpr double inf = std::numeric_limits<double>::infinity();
  check_refused("speed", [&] { drive({inf, 1, 1}); });
  check_refused("inertia", [&] { drive({1, 1, inf}); });
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    check_refused("speed", [&] { drive({bad, 1, 1}); });
    check_refused("stall_torque", [&] { drive({1, bad, 1}); });
    check_refused("inertia", [&] { drive({1, 1, bad}); });
  }
}

}  // namespace
