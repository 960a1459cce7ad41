// SPDX-License-Identifier: MIT
// The adapter on the stand-in, tick by tick: units, wrists, gripper, TimeGuard, weight, brake, calibration.
#include "force_dimension/fixture.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <stdexcept>

#include "support/malloc_hook.hpp"
#include "support/near.hpp"

namespace {

using namespace trephine;
using namespace trephine::test;
using force_dimension::Device;
using force_dimension::kGripperButton;
using force_dimension::Trip;

/// A turn about an axis of no plane, 10, 20 and 30 mm from the origin.
Posed turned() {
  return make_pose<double>(Mat3d(Eigen::AngleAxisd(1.0, Vec3d(1, 2, 3).normalized())), Vec3d(0.01, 0.02, 0.03));
}

}  // namespace

TEST_CASE("Force Dimension: poses, forces and torques are SI and in the vendor's axes") {
  Bench b(rigid("sigma.7", turned()));
  b.start();
  CHECK((b.state.X_DH.matrix() - turned().matrix()).norm() < 1e-7);  // the force moves 1000 kg a little
  CHECK(seen().felt == b.push);
  CHECK(seen().command == b.push);
  CHECK_FALSE(b.state.time.has_value());
}

TEST_CASE("Force Dimension: without a wrist no rotation, with a passive one no torque") {
  struct Row {
    const char* name;
    int input_dof, output_dof;
    double force, torque, stiffness;
    bool left;
  };
  for (const Row& row : {Row{"omega.3", 3, 3, 12, 0, 5000, false}, Row{"omega.6", 6, 3, 12, 0, 5000, false},
                         Row{"sigma.7", 6, 6, 12, 0.2, 4000, false}, Row{"lambda.7", 6, 6, 8, 0.1, 2000, false},
                         Row{"lambda.7 left", 6, 6, 8, 0.1, 2000, true}}) {
    CAPTURE(row.name);
    Bench b(rigid(row.name, turned()));
    b.start();
    const DeviceCapabilities c = b.device->capabilities();
    CHECK(c.name == row.name);
    CHECK(c.input_dof == row.input_dof);
    CHECK(c.output_dof == row.output_dof);
    CHECK(c.max_force == row.force);
    CHECK(c.max_torque == row.torque);
    CHECK(c.stiffness == row.stiffness);
    CHECK(c.rate == 1000);
    CHECK(b.device->left_handed() == row.left);
    const Mat3d R = row.input_dof == 6 ? Mat3d(turned().linear()) : Mat3d(Mat3d::Identity());
    CHECK((b.state.X_DH.linear() - R).norm() < 1e-7);
    CHECK(seen().felt.force == b.push.force);
    CHECK(seen().command.torque.x() == (row.output_dof == 6 ? 0.01 : 0));
  }
}

TEST_CASE("Force Dimension: a closed gripper is a button of its own, on either hand, and does not chatter") {
  for (const char* name : {"sigma.7", "lambda.7 left"}) {
    CAPTURE(name);
    dhd_standin::Model model = rigid(name);
    model.hand = [](double) { return HandTarget(Posed::Identity(), 0x8005); };
    Bench b(model);
    const auto at = [&](double angle) {
      dhd_standin::open_gripper(angle);
      b.tick();
      return b.state.buttons;
    };
    CHECK(at(0.4) == 0x8005);
    CHECK(at(0.1) == 0x8005);
    CHECK(at(0.07) == (0x8005 | kGripperButton));
    CHECK(at(0.11) == (0x8005 | kGripperButton));  // between closing and opening it stays
    CHECK(at(0.13) == 0x8005);
  }
  Bench b(rigid("omega.6"));  // has none
  CHECK(b.tick() != DeviceStatus::kFault);
  CHECK(b.state.buttons == 0);
}

TEST_CASE("Force Dimension: a read that TimeGuard throttles is good and gives the old pose") {
  dhd_standin::Model model = dhd_standin::model("omega.3");
  model.mechanics.linear.quantum = 0;
  model.hand = [](double t) { return Posed(Eigen::Translation3d(0.05 * t, 0, 0)); };
  Bench b(model);
  b.start();
  double last = b.state.X_DH.translation().x();
  dhd_standin::pass(100e-6);  // under the guard's 250
  CHECK(b.device->read(b.state) == DeviceStatus::kOk);
  CHECK(b.state.X_DH.translation().x() == last);
  CHECK(b.device->write(b.push) == DeviceStatus::kOk);
  CHECK(seen().felt.force == b.push.force);
  dhd_standin::pass(200e-6);
  CHECK(b.device->read(b.state) == DeviceStatus::kOk);
  CHECK(b.state.X_DH.translation().x() > last);
}

TEST_CASE("Force Dimension: the arm's weight is compensated while commands come, also those of a trip") {
  Bench b(rigid("omega.3"));
  b.start();
  CHECK(seen().compensation == near(dhd_standin::kMassOfArm * dhd_standin::kStandardGravity));
  dhd_standin::inject(dhd_standin::Fault::kJump);
  CHECK(b.tick() == DeviceStatus::kSafetyTrip);
  CHECK(seen().felt == Wrenchd::zero());
  CHECK(seen().compensation > 1);
  dhd_standin::pass(0.05);  // nobody ticks: the watchdog takes it, and a force with it
  CHECK(seen().compensation == 0);
  CHECK_FALSE(seen().enabled);
  CHECK(seen().cause == DHD_FORCEOFF_WATCHDOG);
}

TEST_CASE("Force Dimension: a program that hangs leaves no force after 10 ms") {
  Bench b(rigid("sigma.7"));
  b.start();
  const double last = dhd_standin::now();
  dhd_standin::pass(0.05);
  CHECK(seen().felt == Wrenchd::zero());
  CHECK(seen().felt_until - last <= 0.010 + 1e-9);
  // And its next tick does not push at once either.
  CHECK(b.ticks(5) == DeviceStatus::kSafetyTrip);
  CHECK(b.device->trip() == Trip::kBrake);
  CHECK(seen().felt == Wrenchd::zero());
}

TEST_CASE("Force Dimension: too high a speed brakes; the force comes back once the handle is held") {
  dhd_standin::Model model = dhd_standin::model("omega.3");
  model.hand = [](double t) {  // 0.2 m at 2 m/s
    return Posed(Eigen::Translation3d(0, t < 1 ? 0 : t < 1.1 ? 2 * (t - 1) : 0.2, 0));
  };
  Bench b(model);
  b.push = {Vec3d(0, 0, 0.5), Vec3d::Zero()};
  b.start();
  CHECK(seen().felt == b.push);
  int until_brake = 0;
  while (seen().enabled && ++until_brake < 1000) b.tick();
  REQUIRE(until_brake < 1000);
  CHECK(seen().cause == DHD_FORCEOFF_VELOCITY);
  CHECK(b.ticks(4) == DeviceStatus::kSafetyTrip);
  CHECK(b.device->trip() == Trip::kBrake);
  // Not while it moves, nor before it has been held for half a second.
  b.ticks(495);
  CHECK_FALSE(seen().enabled);
  CHECK(seen().command == Wrenchd::zero());
  int until_back = 0;
  while (!seen().enabled && ++until_back < 1000) b.tick();
  CHECK(until_back > 5);
  REQUIRE(until_back < 1000);
  CHECK(seen().felt == Wrenchd::zero());  // the loop's ramp begins after a trip, so none is sent in its last tick
  b.ticks(3);
  CHECK(b.device->trip() == Trip::kNone);
  CHECK(seen().felt == b.push);
}

TEST_CASE("Force Dimension: what a person switched off stays off until it is switched on again") {
  Bench b(rigid("sigma.7"));
  b.start();
  dhd_standin::press_force_button();
  b.ticks(2000);
  CHECK(b.read == DeviceStatus::kSafetyTrip);
  CHECK(b.device->trip() == Trip::kButton);
  CHECK_FALSE(seen().enabled);
  CHECK(seen().command == Wrenchd::zero());
  dhd_standin::press_force_button();
  CHECK(b.tick() == DeviceStatus::kSafetyTrip);
  CHECK(seen().felt == Wrenchd::zero());
  CHECK(b.tick() == DeviceStatus::kOk);
  CHECK(seen().felt == b.push);
}

TEST_CASE("Force Dimension: no force before the device is calibrated") {
  dhd_standin::Model model = rigid("sigma.7");
  model.calibrated = false;
  SUBCASE("by its motors") {
    Bench b(model);
    b.start();
    CHECK(seen().felt == b.push);
    CHECK(b.state.X_DH.translation().x() < 0.1 * dhd_standin::kOffset);
  }
  SUBCASE("by hand, because it is asked for or DRD does not know the device") {
    force_dimension::DeviceOptions options;
    SUBCASE("asked for") { options.auto_init = false; }
    SUBCASE("not robotic") { model.robotic = false; }
    Bench b(model, options);
    CHECK(b.ticks(1000) == DeviceStatus::kSafetyTrip);
    CHECK(b.device->trip() == Trip::kUncalibrated);
    CHECK(seen().most_force == 0);
    CHECK_FALSE(seen().enabled);
    dhd_standin::calibrate_by_hand();
    CHECK(b.tick() == DeviceStatus::kSafetyTrip);
    b.start();
    CHECK(b.read == DeviceStatus::kOk);
    CHECK(seen().felt == b.push);
  }
}

TEST_CASE("Force Dimension: commands are shortened to the device's, late ones and NaN become zero") {
  Bench b(rigid("sigma.7"));
  b.start();
  b.push = {Vec3d(0, 30, 40), Vec3d(0, 0, -3)};
  CHECK(b.tick() == DeviceStatus::kOk);
  CHECK((seen().command.force - Vec3d(0, 7.2, 9.6)).norm() < 1e-12);
  CHECK((seen().command.torque - Vec3d(0, 0, -0.2)).norm() < 1e-12);
  CHECK(b.device->read(b.state) == DeviceStatus::kOk);
  dhd_standin::pass(0.009);  // the scene took so long
  CHECK(b.device->write(b.push) == DeviceStatus::kSafetyTrip);
  CHECK(seen().command == Wrenchd::zero());
  CHECK(b.tick() == DeviceStatus::kOk);
  b.push.torque.y() = std::numeric_limits<double>::quiet_NaN();
  b.tick();
  CHECK(b.wrote == DeviceStatus::kFault);
  CHECK(seen().felt == Wrenchd::zero());
  CHECK(b.device->fault_text().find("force law overflowed") != std::string::npos);
}

TEST_CASE("Force Dimension: devices are opened by name and closed in order") {
  dhd_standin::plug({rigid("omega.3"), rigid("lambda.7"), rigid("lambda.7 left")});
  {
    Device left({.name = "lambda.7 left"});
    CHECK(left.capabilities().name == "lambda.7 left");
    CHECK(dhd_standin::open_devices() == 1);
    Device first;
    CHECK(first.capabilities().name == "omega.3");
    CHECK_THROWS_WITH_AS(Device({.name = "sigma.7"}), "cannot open device 'sigma.7'; there is lambda.7",
                         std::runtime_error);
  }
  CHECK(dhd_standin::open_devices() == 0);
  dhd_standin::plug({});
  CHECK_THROWS_WITH_AS(
      Device{},
      "cannot open a device: the device was not found: check cable, power and permission (driver's error 5, no such "
      "device)",
      std::runtime_error);
}

TEST_CASE("Force Dimension: a tick takes nothing from the heap") {
  if (!AllocationGuard::available()) return;
  Bench b(rigid("lambda.7 left"));
  b.start();
  CHECK(heap_calls([&] { b.ticks(20); }) == 0);
  dhd_standin::inject(dhd_standin::Fault::kCommunication);
  CHECK(heap_calls([&] { b.ticks(20); }) == 0);
  CHECK(b.read == DeviceStatus::kFault);
}
