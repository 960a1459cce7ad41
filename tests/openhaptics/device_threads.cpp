// SPDX-License-Identifier: MIT
// The adapter alone: what it reads, what it sends, and what it makes of errors.
#include "openhaptics/fixture.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/malloc_hook.hpp"
#include "support/near.hpp"

namespace {

using namespace trephine;
using namespace trephine::test;
using openhaptics::Calibration;
using openhaptics::Device;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("OpenHaptics device: capabilities are the device's, in SI units") {
  hd_standin::plug({rigid()});
  const Device device;
  const DeviceCapabilities c = device.capabilities();
  CHECK(c.name == "stand-in");
  CHECK(c.input_dof == 6);
  CHECK(c.output_dof == 6);
  CHECK(c.max_force == near(3.3));
  CHECK(c.max_torque == near(0.1));
  CHECK(c.stiffness == near(1000));
  CHECK(c.rate == 1000);
  CHECK(hd_standin::errors().empty());
}

TEST_CASE("OpenHaptics device: unknown limits get careful ones; no torque is asked of three degrees of freedom") {
  hd_standin::Model six = rigid();
  six.max_force_N = six.max_torque_mNm = six.max_stiffness_N_mm = 0;
  hd_standin::plug({six});
  {
    const Device device({.unknown_force = 0.7, .unknown_torque = 0.01});
    CHECK(device.capabilities().max_force == 0.7);
    CHECK(device.capabilities().max_torque == 0.01);
    CHECK(device.capabilities().stiffness == 0);
  }
  hd_standin::plug({rigid("Default Device", 3)});
  const Device device;
  CHECK(device.capabilities().output_dof == 3);
  CHECK(device.capabilities().max_torque == 0);
  CHECK(hd_standin::errors().empty());  // nothing that it does not know was asked for
}

TEST_CASE("OpenHaptics device: pose and buttons in, force and torque out, in one frame a tick") {
  hd_standin::Model model = rigid();
  const Mat3d R = rotation_from_vector<double>(Vec3d(0.3, -0.7, 1.1));
  model.mechanics.X_DH = make_pose<double>(R, Vec3d(0.011, -0.022, 0.033));
  model.hand = [X = model.mechanics.X_DH](double) { return HandTarget(X, 5); };
  hd_standin::plug({model});
  Device device;
  DeviceState state, unmoved;
  const Wrenchd wrench{Vec3d(1, -2, 0.5), Vec3d(0.02, 0.03, -0.04)};
  Wrenchd felt;
  int good = 0;
  CHECK(in_ticks(device, 10, [&](int i) {
    good += device.read(state) == DeviceStatus::kOk && device.write(wrench) == DeviceStatus::kOk;
    if (i == 0) unmoved = state;
    felt = hd_standin::witness("Default Device").felt;
  }));
  CHECK(good == 10);
  CHECK((unmoved.X_DH.translation() - Vec3d(0.011, -0.022, 0.033)).norm() < 1e-15);
  CHECK((unmoved.X_DH.linear() - R).norm() < 1e-14);
  CHECK(state.buttons == 5);
  CHECK_FALSE(state.time.has_value());
  CHECK((felt.force - wrench.force).norm() < 1e-15);
  CHECK((felt.torque - wrench.torque).norm() < 1e-15);
  CHECK(hd_standin::witness("Default Device").frames == 10);
  CHECK(hd_standin::witness("Default Device").felt == Wrenchd::zero());  // stopped
  CHECK(hd_standin::errors().empty());
  CHECK_FALSE(hd_standin::scheduler_runs());
}

TEST_CASE("OpenHaptics device: neither reading nor writing takes memory or throws") {
  static_assert(noexcept(std::declval<Device&>().read(std::declval<DeviceState&>())));
  static_assert(noexcept(std::declval<Device&>().write(std::declval<const Wrenchd&>())));
  hd_standin::plug({rigid()});
  Device device;
  DeviceState state;
  std::int64_t calls = 0;
  CHECK(in_ticks(device, 300, [&](int i) {  // past a look at the calibration, which comes every hundred ticks
    const AllocationGuard guard;
    (void)device.read(state);
    (void)device.write({Vec3d(1, 0, 0), Vec3d(0, 0.01, 0)});
    if (i > 0) calls += guard.allocations();
  }));
  CHECK(calls == 0);
  CHECK(hd_standin::errors().empty());
}

TEST_CASE("OpenHaptics device: wrenches are gated by degrees of freedom and shortened to the limits") {
  for (const int dof : {3, 6}) {
    hd_standin::plug({rigid("Default Device", dof)});
    Device device;
    DeviceState state;
    Wrenchd felt;
    CHECK(in_ticks(device, 3, [&](int) {
      (void)device.read(state);
      CHECK(device.write({Vec3d(30, 0, 40), Vec3d(0, 5, 0)}) == DeviceStatus::kOk);
      felt = hd_standin::witness("Default Device").felt;
    }));
    CHECK((felt.force - 3.3 * Vec3d(0.6, 0, 0.8)).norm() < 7e-16);
    CHECK((felt.torque - (dof == 6 ? Vec3d(0, 0.1, 0) : Vec3d(0, 0, 0))).norm() < 1e-9);
    CHECK(hd_standin::errors().empty());
  }
}

TEST_CASE("OpenHaptics device: a command that is no number sends zero and is a fault that says so") {
  hd_standin::plug({rigid()});
  Device device;
  DeviceState state;
  for (const Wrenchd& bad : {Wrenchd{Vec3d(0, kNan, 0), Vec3d::Zero()},
                             Wrenchd{Vec3d(1, 0, 0), Vec3d(0, 0, std::numeric_limits<double>::infinity())}}) {
    CHECK(in_ticks(device, 2, [&](int i) {
      (void)device.read(state);
      const DeviceStatus status = device.write(i == 0 ? Wrenchd{Vec3d(1, 1, 1), Vec3d::Zero()} : bad);
      CHECK(status == (i == 0 ? DeviceStatus::kOk : DeviceStatus::kFault));
      if (i == 1) CHECK(hd_standin::witness("Default Device").felt == Wrenchd::zero());
    }));
    CHECK(device.fault_text().find("not a finite number") != std::string::npos);
  }
  CHECK(hd_standin::errors().empty());
}

TEST_CASE("OpenHaptics device: a pose that is no number is a fault") {
  hd_standin::plug({rigid()});
  Device device;
  DeviceState state;
  hd_standin::break_pose("Default Device", true);
  CHECK(in_ticks(device, 1, [&](int) {
    CHECK(device.read(state) == DeviceStatus::kFault);
    CHECK(device.write(Wrenchd::zero()) == DeviceStatus::kOk);
  }));
  CHECK(device.fault_text().find("pose that is no finite number") != std::string::npos);
}

TEST_CASE("OpenHaptics device: a write without a frame is a fault and changes nothing") {
  hd_standin::plug({rigid()});
  Device device;
  CHECK(device.write(Wrenchd::zero()) == DeviceStatus::kFault);
  DeviceState state;
  CHECK(in_ticks(device, 2, [&](int) {
    (void)device.read(state);
    CHECK(device.write({Vec3d(1, 0, 0), Vec3d::Zero()}) == DeviceStatus::kOk);
    CHECK(device.write(Wrenchd::zero()) == DeviceStatus::kFault);
    CHECK(hd_standin::witness("Default Device").felt.force.x() == 1);
  }));
  CHECK(hd_standin::errors().empty());
}

TEST_CASE("OpenHaptics device: a frame left open by the caller is closed") {
  hd_standin::plug({rigid()});
  Device device;
  DeviceState state;
  CHECK(in_ticks(device, 5, [&](int) { CHECK(device.read(state) == DeviceStatus::kOk); }));
  CHECK(hd_standin::errors().empty());
  CHECK(hd_standin::witness("Default Device").frames == 5);
}

TEST_CASE("OpenHaptics device: every error of the driver, at begin and at end of a frame") {
  using hd_standin::At;
  constexpr HDerror kCodes[] = {HD_WARM_MOTORS,
                                HD_EXCEEDED_MAX_FORCE,
                                HD_EXCEEDED_MAX_FORCE_IMPULSE,
                                HD_EXCEEDED_MAX_VELOCITY,
                                HD_FORCE_ERROR,
                                HD_DEVICE_FAULT,
                                HD_COMM_ERROR,
                                HD_COMM_CONFIG_ERROR,
                                HD_TIMER_ERROR,
                                HD_ILLEGAL_BEGIN,
                                HD_ILLEGAL_END,
                                HD_FRAME_ERROR,
                                HD_INVALID_PRIORITY,
                                HD_SCHEDULER_FULL,
                                HD_INVALID_LICENSE,
                                HD_INVALID_ENUM,
                                HD_INVALID_VALUE,
                                HD_INVALID_OPERATION,
                                HD_INVALID_INPUT_TYPE,
                                HD_BAD_HANDLE,
                                HD_DEVICE_ALREADY_INITIATED,
                                0x7777};
  for (const At at : {At::kBeginFrame, At::kEndFrame})
    for (const HDerror code : kCodes) {
      CAPTURE(code);
      hd_standin::plug({rigid()});
      Device device;
      hd_standin::inject({.code = code, .at = at, .after = 2});
      std::vector<DeviceStatus> reads, writes;
      DeviceState state;
      CHECK(in_ticks(device, 5, [&](int) {
        reads.push_back(device.read(state));
        writes.push_back(device.write(Wrenchd::zero()));
      }));
      const DeviceStatus expected = openhaptics::status_of(code);
      for (std::size_t i = 0; i < 5; ++i) {
        CHECK(reads[i] == (i == 2 && at == At::kBeginFrame ? expected : DeviceStatus::kOk));
        CHECK(writes[i] == (i == 2 && at == At::kEndFrame ? expected : DeviceStatus::kOk));
      }
      CHECK((expected == DeviceStatus::kFault) ==
            (device.fault_text().find(openhaptics::advice(code)) != std::string::npos));
      CHECK(device.trips() == (expected == DeviceStatus::kSafetyTrip ? 1 : 0));
    }
}

TEST_CASE("OpenHaptics device: many errors at once are drained, and the worst counts") {
  hd_standin::plug({rigid()});
  Device device;
  for (const HDerror code : std::vector<HDerror>{HD_WARM_MOTORS, HD_COMM_ERROR, HD_EXCEEDED_MAX_FORCE})
    hd_standin::inject({.code = code, .at = hd_standin::At::kEndFrame});
  DeviceState state;
  std::vector<DeviceStatus> writes;
  CHECK(in_ticks(device, 2, [&](int) {
    (void)device.read(state);
    writes.push_back(device.write(Wrenchd::zero()));
  }));
  CHECK(writes == std::vector<DeviceStatus>{DeviceStatus::kFault, DeviceStatus::kOk});
  CHECK(popped().empty());
}

TEST_CASE("OpenHaptics device: the first fault is the one told") {
  hd_standin::plug({rigid()});
  Device device;
  hd_standin::inject({.code = HD_COMM_ERROR, .after = 1});
  hd_standin::inject({.code = HD_TIMER_ERROR, .after = 2});
  DeviceState state;
  CHECK(in_ticks(device, 5, [&](int) {
    (void)device.read(state);
    (void)device.write(Wrenchd::zero());
  }));
  CHECK(device.fault_text().find(openhaptics::advice(HD_COMM_ERROR)) == 0);
}

TEST_CASE("OpenHaptics device: no force before calibration, nor in the tick of its jump") {
  hd_standin::Model model = rigid();
  model.calibration = HD_CALIBRATION_NEEDS_UPDATE;
  model.calibration_ticks = 5;
  model.calibration_jump_mm = 50;
  hd_standin::plug({model});
  Device device;
  CHECK(device.calibration() == Calibration::kUnknown);
  std::vector<DeviceStatus> reads;
  std::vector<double> x;
  CHECK(in_ticks(device, 12, [&](int) {
    DeviceState state;
    reads.push_back(device.read(state));
    x.push_back(state.X_DH.translation().x());
    (void)device.write(Wrenchd::zero());
  }));
  CHECK(device.calibration() == Calibration::kGood);
  std::size_t jump = 0;
  while (jump < 12 && x[jump] > 0.025) ++jump;
  CHECK(jump >= 4);
  CHECK(jump < 11);
  for (std::size_t i = 0; i < 12; ++i) {
    CAPTURE(i);
    CHECK(reads[i] == (i <= jump ? DeviceStatus::kSafetyTrip : DeviceStatus::kOk));
  }
  CHECK(hd_standin::errors().empty());
}

TEST_CASE("OpenHaptics device: waits for a hand where calibration needs one") {
  hd_standin::Model model = rigid();
  model.calibration = HD_CALIBRATION_NEEDS_MANUAL_INPUT;
  hd_standin::plug({model});
  Device device;
  std::vector<DeviceStatus> reads;
  CHECK(in_ticks(device, 20, [&](int i) {
    DeviceState state;
    if (i == 10) {
      CHECK(device.calibration() == Calibration::kNeedsHand);
      hd_standin::calibrate_by_hand("Default Device");
    }
    reads.push_back(device.read(state));
    (void)device.write(Wrenchd::zero());
  }));
  for (std::size_t i = 0; i < 20; ++i) CHECK(reads[i] == (i <= 10 ? DeviceStatus::kSafetyTrip : DeviceStatus::kOk));
}

TEST_CASE("OpenHaptics device: names; what cannot be opened says what to do") {
  hd_standin::Model broken = rigid("Broken");
  broken.open_error = HD_INVALID_LICENSE;
  hd_standin::plug({rigid("Left"), rigid("Right"), broken});
  const auto text = [](const char* name) {
    try {
      const Device device({.name = name});
    } catch (const std::runtime_error& e) {
      return std::string(e.what());
    }
    return std::string("opened");
  };
  CHECK(text("Right") == "opened");
  CHECK(text("") == "opened");
  CHECK(text("Middle").find("openhaptics: cannot open device 'Middle': the device was not found: check cable") == 0);
  CHECK(text("Broken").find("licence") != std::string::npos);
  {
    const Device right({.name = "Right"});
    CHECK(text("Right").find("open already") != std::string::npos);
  }
  CHECK(hd_standin::open_devices() == 0);
  CHECK(popped().empty());
}

TEST_CASE("OpenHaptics device: a start that fails leaves nothing behind, and can be tried again") {
  hd_standin::plug({rigid()});
  Device device;
  const ServoCallback last = [](void*) noexcept { return false; };
  for (const hd_standin::At at : {hd_standin::At::kSchedule, hd_standin::At::kStartScheduler}) {
    const HDerror code = at == hd_standin::At::kSchedule ? HD_SCHEDULER_FULL : HD_TIMER_ERROR;
    hd_standin::inject({.code = code, .at = at});
    CHECK(device.start(last, nullptr) == DeviceStatus::kFault);
    CHECK(device.fault_text().find(openhaptics::advice(code)) == 0);
    CHECK(hd_standin::scheduled() == 0);
    CHECK_FALSE(hd_standin::scheduler_runs());
    device.stop();  // harmless
  }
  DeviceState state;
  CHECK(in_ticks(device, 3, [&](int) {
    (void)device.read(state);
    CHECK(device.write(Wrenchd::zero()) == DeviceStatus::kOk);
  }));
  CHECK(device.fault_text() == "no error");
  CHECK(popped().empty());
}
