// SPDX-License-Identifier: MIT
// The servo loop on the adapter: trips are survived, faults end with no force and a message, devices share a scheduler.
#include "clutch.hpp"
#include "openhaptics/fixture.hpp"

#include <trephine/device/servo_loop.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "device/archetypes.hpp"
#include "support/near.hpp"

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace std::chrono_literals;
using openhaptics::Clutched;
using openhaptics::Device;

/// Fails the test if the rules were broken, whoever noticed.
void check_no_errors_but(std::initializer_list<HDerror> expected) {
  for (const auto& pushed : hd_standin::errors()) {
    CAPTURE(pushed.first);
    CHECK(std::find(expected.begin(), expected.end(), pushed.first) != expected.end());
  }
}

Wrenchd felt() { return hd_standin::witness("Default Device").felt; }

/// Ends what waits for something that does not come.
bool late(const TickRecord& t) { return t.time > 10; }
/// The whole wrench is out. When that is so is the machine's to say: each of its stalls starts a ramp anew.
bool full(const TickRecord& t) { return t.ramp == 1 || late(t); }

}  // namespace

TEST_CASE("OpenHaptics servo: ticks, ramps up and leaves no force behind") {
  hd_standin::plug({rigid()});
  Device device;
  ScriptedScene scene;
  scene.wrench = {Vec3d(0, 2, 0), Vec3d(0.01, 0, 0)};
  ServoLoop loop(device, scene, Registration{});
  CHECK(loop.warnings().empty());
  const RunReport report = loop.run_until([](const TickRecord& t) { return t.index >= 100 && full(t); });
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.zeroed);
  CHECK(hd_standin::witness("Default Device").most_force == near(2));
  CHECK(hd_standin::witness("Default Device").most_torque == near(0.01));
  CHECK(felt() == Wrenchd::zero());
  CHECK_FALSE(hd_standin::scheduler_runs());
  CHECK(hd_standin::scheduled() == 0);
  check_no_errors_but({});
  CHECK(loop.run_for(20ms).end == RunEnd::kFinished);  // and again
}

TEST_CASE("OpenHaptics servo: the registration's torque arrives about the driver's point, in mN·m") {
  hd_standin::plug({rigid()});
  Device device;
  ScriptedScene scene;
  scene.wrench = {Vec3d(0, 1, 0), Vec3d::Zero()};
  // The burr 50 mm along -z of the handle: its force turns the handle about +x.
  const Registration registration(Posed::Identity(), Posed(Eigen::Translation3d(0, 0, -0.05)));
  ServoLoop(device, scene, registration).run_until(full);
  CHECK(hd_standin::witness("Default Device").most_torque == near(0.05));
  check_no_errors_but({});
}

TEST_CASE("OpenHaptics servo: every safety trip is survived: zero at once, then a ramp") {
  for (const HDerror code : std::vector<HDerror>{HD_WARM_MOTORS, HD_EXCEEDED_MAX_FORCE, HD_EXCEEDED_MAX_FORCE_IMPULSE,
                                                 HD_EXCEEDED_MAX_VELOCITY, HD_FORCE_ERROR}) {
    CAPTURE(code);
    hd_standin::plug({rigid()});
    Device device;
    ScriptedScene scene;
    scene.wrench = {Vec3d(0, 1, 0), Vec3d::Zero()};
    ServoOptions options;
    options.ramp = 0.02;
    bool injected = false;
    std::vector<double> sent;  // from the tick on whose write is the first of three trips
    const RunReport report = ServoLoop{device, scene, Registration{}, options}.run_until([&](const TickRecord& t) {
      if (injected) sent.push_back(t.sent.force.norm());
      if (!injected && t.ramp == 1) {
        hd_standin::inject({.code = code, .at = hd_standin::At::kEndFrame, .times = 3});
        injected = true;
      }
      return late(t) || (sent.size() > 4 && t.ramp == 1);
    });
    CHECK(report.end == RunEnd::kFinished);
    CHECK(report.safety_trips == 3);
    CHECK(report.ramps >= 2);
    REQUIRE(sent.size() > 4);
    for (const std::size_t i : {1U, 2U, 3U}) CHECK(sent[i] == 0);
    // Up and up; a stall of the machine may take it to the beginning.
    for (std::size_t i = 4; i < sent.size(); ++i) CHECK((sent[i] == 0 || sent[i] > sent[i - 1]));
    CHECK(sent.back() == 1);
    CHECK(device.trips() == 3);
    check_no_errors_but({code});
  }
}

TEST_CASE("OpenHaptics servo: every fault stops without force and says what to do") {
  using hd_standin::At;
  for (const HDerror code : std::vector<HDerror>{HD_DEVICE_FAULT, HD_COMM_ERROR, HD_COMM_CONFIG_ERROR, HD_TIMER_ERROR,
                                                 HD_INVALID_PRIORITY, HD_SCHEDULER_FULL, HD_INVALID_LICENSE, 0x7777})
    for (const At at : {At::kBeginFrame, At::kEndFrame}) {
      CAPTURE(code);
      hd_standin::plug({rigid()});
      Device device;
      hd_standin::inject({.code = code, .at = at, .after = 30});
      ScriptedScene scene;
      const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(10s);
      CHECK(report.end == RunEnd::kFault);
      CHECK(report.reason.find(openhaptics::advice(code)) != std::string::npos);
      CHECK(report.zeroed);
      CHECK(report.ticks < 40);
      CHECK(felt() == Wrenchd::zero());
      CHECK_FALSE(hd_standin::scheduler_runs());
      check_no_errors_but({code});
    }
}

TEST_CASE(
    "OpenHaptics servo: communication that stays lost is reported as force not taken back, and stopped all the same") {
  hd_standin::plug({rigid()});
  Device device;
  hd_standin::inject({.code = HD_COMM_ERROR, .times = 1000, .after = 30});
  ScriptedScene scene;
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(10s);
  CHECK(report.end == RunEnd::kFault);
  CHECK_FALSE(report.zeroed);
  CHECK_FALSE(hd_standin::scheduler_runs());
  CHECK(felt() == Wrenchd::zero());
}

TEST_CASE("OpenHaptics servo: a driver that no longer calls is noticed, and left in order") {
  hd_standin::plug({rigid()});
  {
    Device device;
    ScriptedScene scene;
    ServoOptions options;
    options.callback_timeout = 0.1;
    std::thread other([] {
      std::this_thread::sleep_for(50ms);
      hd_standin::hang(true);
    });
    const RunReport report = ServoLoop{device, scene, Registration{}, options}.run_for(10s);
    other.join();
    CHECK(report.end == RunEnd::kFault);
    CHECK(report.reason.find("the device stopped calling") == 0);
    CHECK(felt() == Wrenchd::zero());
    CHECK(hd_standin::scheduled() == 0);
    CHECK_FALSE(hd_standin::scheduler_runs());
  }
  CHECK(hd_standin::open_devices() == 0);
  check_no_errors_but({});
}

TEST_CASE("OpenHaptics servo: no force while calibration needs a hand") {
  hd_standin::Model model = rigid();
  model.calibration = HD_CALIBRATION_NEEDS_MANUAL_INPUT;
  model.calibration_jump_mm = 30;
  hd_standin::plug({model});
  Device device;
  ScriptedScene scene;
  ServoOptions options;
  options.ramp = 0.02;
  const RunReport waiting = ServoLoop{device, scene, Registration{}, options}.run_for(100ms);
  CHECK(waiting.end == RunEnd::kFinished);
  CHECK(waiting.safety_trips == waiting.ticks);
  CHECK(hd_standin::witness("Default Device").most_force == 0);
  hd_standin::calibrate_by_hand("Default Device");
  CHECK(ServoLoop{device, scene, Registration{}, options}.run_until(full).safety_trips == 1);
  CHECK(hd_standin::witness("Default Device").most_force > 0);
}

TEST_CASE("OpenHaptics servo: a clutch between loop and device takes the force off and brings it back gently") {
  hd_standin::Model model = rigid();
  bool pressed = false;  // by the servo thread, as all that a hand does
  model.hand = [&pressed](double) { return HandTarget(Posed::Identity(), pressed ? 3u : 1u); };
  hd_standin::plug({model});
  Device device;
  Clutched clutched(device, 2);
  ScriptedScene scene;
  ServoOptions options;
  options.ramp = 0.02;
  int held = 0, forced_while_held = 0, spun_while_held = 0;
  double last = 0;
  const RunReport report = ServoLoop{clutched, scene, Registration{}, options}.run_until([&](const TickRecord& t) {
    const bool is_held = (t.state.buttons & 2) != 0;
    held += is_held;
    forced_while_held += is_held && t.sent.force.norm() > 0;
    spun_while_held += is_held && t.input.spindle_on;
    last = t.sent.force.norm();
    pressed = held < 50 && (held > 0 || t.ramp == 1);
    return late(t) || (held >= 50 && t.ramp == 1);
  });
  CHECK(report.end == RunEnd::kFinished);
  CHECK(held >= 50);
  CHECK(forced_while_held == 0);
  CHECK(spun_while_held == 0);
  CHECK(last == near(3.3));  // the scene's 3.7 N, shortened to the device's limit
  CHECK(device.trips() == 0);
  check_no_errors_but({});
}

TEST_CASE("OpenHaptics servo: two devices share the scheduler; the last one stops it") {
  hd_standin::plug({rigid("Left"), rigid("Right", 3)});
  Device left({.name = "Left"}), right({.name = "Right"});
  ScriptedScene scene_left, scene_right;
  scene_left.wrench = {Vec3d(1, 0, 0), Vec3d(0, 0.02, 0)};
  scene_right.wrench = {Vec3d(0, 0, -2), Vec3d(0, 0.02, 0)};
  RunReport report_left;
  ServoLoop loop_right(right, scene_right, Registration{});
  std::atomic<bool> left_ended{false};
  std::thread other([&] {
    report_left = ServoLoop{left, scene_left, Registration{}}.run_until(full);
    left_ended = true;
  });
  const RunReport report_right =
      loop_right.run_until([&](const TickRecord& t) { return late(t) || (left_ended && full(t)); });
  other.join();
  for (const RunReport& report : {report_left, report_right}) {
    CHECK(report.end == RunEnd::kFinished);
    CHECK(report.zeroed);
    CHECK(report.safety_trips == 0);
  }
  CHECK(hd_standin::witness("Left").most_force == near(1));
  CHECK(hd_standin::witness("Left").most_torque == near(0.02));
  CHECK(hd_standin::witness("Right").most_force == near(2));
  CHECK(hd_standin::witness("Right").most_torque == 0);
  CHECK_FALSE(hd_standin::scheduler_runs());
  check_no_errors_but({});
}

TEST_CASE("OpenHaptics servo: an error finds the device that it names; the other goes on") {
  hd_standin::plug({rigid("Left"), rigid("Right")});
  Device left({.name = "Left"}), right({.name = "Right"});
  for (const HDerror code : std::vector<HDerror>{HD_COMM_ERROR, HD_WARM_MOTORS}) {
    hd_standin::inject({.code = code, .after = 60, .device = "Left"});
    ScriptedScene scene_left, scene_right;
    RunReport report_left;
    std::atomic<bool> left_ended{false};
    std::thread other([&] {
      bool tripped = false;
      int ticks_after = 0;
      report_left = ServoLoop{left, scene_left, Registration{}}.run_until([&](const TickRecord& t) {
        tripped = tripped || t.write_status == DeviceStatus::kSafetyTrip;
        ticks_after += tripped;
        return late(t) || ticks_after > 50;
      });
      left_ended = true;
    });
    int ticks_alone = 0;
    const RunReport report_right = ServoLoop{right, scene_right, Registration{}}.run_until([&](const TickRecord& t) {
      ticks_alone += left_ended;
      return late(t) || ticks_alone > 50;
    });
    other.join();
    CHECK(ticks_alone > 50);
    CHECK(report_left.end == (code == HD_COMM_ERROR ? RunEnd::kFault : RunEnd::kFinished));
    CHECK(report_left.safety_trips == (code == HD_COMM_ERROR ? 0 : 1));
    CHECK(report_right.end == RunEnd::kFinished);
    CHECK(report_right.safety_trips == 0);
    CHECK(right.trips() == 0);
  }
}

TEST_CASE("OpenHaptics servo: one device popping the other's errors hands them over; a stop leaves no force") {
  hd_standin::plug({rigid("Left"), rigid("Right")});
  Device left({.name = "Left"}), right({.name = "Right"});
  struct Seen {
    Device& device;
    std::atomic<int> ticks{0}, trips{0}, faults{0};
  } at_left{left}, at_right{right};
  const ServoCallback tick = [](void* user) noexcept {
    Seen& seen = *static_cast<Seen*>(user);
    DeviceState state;
    const DeviceStatus read = seen.device.read(state);
    const DeviceStatus status = worse(read, seen.device.write({Vec3d(1, 0, 0), Vec3d::Zero()}));
    seen.trips += status == DeviceStatus::kSafetyTrip;
    seen.faults += status == DeviceStatus::kFault;
    ++seen.ticks;
    return true;
  };
  const auto wait = [](const Seen& seen) {
    for (const int from = seen.ticks; seen.ticks < from + 5;) std::this_thread::sleep_for(1ms);
  };
  REQUIRE(right.start(tick, &at_right) == DeviceStatus::kOk);  // called first, so it pops first
  REQUIRE(left.start(tick, &at_left) == DeviceStatus::kOk);
  wait(at_left);
  hd_standin::inject({.code = HD_COMM_ERROR, .at = hd_standin::At::kTick, .device = "Left"});
  hd_standin::inject({.code = HD_WARM_MOTORS, .at = hd_standin::At::kTick, .after = 2, .device = "Left"});
  wait(at_left);
  CHECK(at_left.faults == 1);
  CHECK(at_left.trips == 1);
  CHECK(at_right.faults == 0);
  CHECK(at_right.trips == 0);
  wait(at_left);
  CHECK(hd_standin::witness("Left").felt.force.x() == 1);
  left.stop();
  CHECK(hd_standin::scheduler_runs());  // for the other
  CHECK(hd_standin::witness("Left").felt.force.norm() == 0);
  wait(at_right);
  CHECK(hd_standin::witness("Right").felt.force.x() == 1);
  right.stop();
  CHECK(hd_standin::witness("Right").felt.force.norm() == 0);
  CHECK_FALSE(hd_standin::scheduler_runs());
  check_no_errors_but({HD_COMM_ERROR, HD_WARM_MOTORS});
}

TEST_CASE("OpenHaptics servo: devices open before the first starts, and close whenever") {
  hd_standin::plug({rigid("Left"), rigid("Right")});
  auto left = std::make_unique<Device>(openhaptics::DeviceOptions{.name = "Left"});
  ScriptedScene scene;
  {
    Device right({.name = "Right"});
    left.reset();
    CHECK(hd_standin::open_devices() == 1);
    left = std::make_unique<Device>(openhaptics::DeviceOptions{.name = "Left"});
    ServoLoop loop(right, scene, Registration{});
    std::string refused;
    std::thread other([&] {
      while (!hd_standin::scheduler_runs()) std::this_thread::sleep_for(1ms);
      left.reset();
      CHECK(hd_standin::open_devices() == 2);  // not under the servo thread's feet
      try {
        const Device again({.name = "Left"});
      } catch (const std::runtime_error& e) {
        refused = e.what();
      }
      loop.stop();
    });
    CHECK(loop.run_for(10s).end == RunEnd::kStopped);
    other.join();
    CHECK(refused == "openhaptics: cannot open device 'Left': open every device before the first one starts");
    CHECK(hd_standin::open_devices() == 1);  // the left one was closed when the scheduler stopped
  }
  CHECK(hd_standin::open_devices() == 0);
  check_no_errors_but({});
}

TEST_CASE("OpenHaptics servo: destroyed while its callback runs") {
  hd_standin::plug({rigid()});
  {
    Device device;
    static std::atomic<int> calls;
    calls = 0;
    const ServoCallback tick = [](void*) noexcept {
      ++calls;
      return true;
    };
    CHECK(device.start(tick, nullptr) == DeviceStatus::kOk);
    CHECK(device.start(tick, nullptr) == DeviceStatus::kFault);  // it runs already
    while (calls < 3) std::this_thread::sleep_for(1ms);
  }
  CHECK(hd_standin::open_devices() == 0);
  CHECK_FALSE(hd_standin::scheduler_runs());
  check_no_errors_but({});
}
