// SPDX-License-Identifier: MIT
// The servo loop on the adapter in real time, with faults from another thread.
#include "force_dimension/fixture.hpp"

#include <trephine/device/servo_loop.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "device/archetypes.hpp"
#include "support/near.hpp"

namespace {

using namespace trephine;
using namespace trephine::test;
using dhd_standin::Fault;

ScriptedScene pushing() {
  ScriptedScene scene;
  scene.wrench = {Vec3d(0, 2, 0), Vec3d(0.01, 0, 0)};
  return scene;
}

/// Ends what waits for something that does not come.
bool late(const TickRecord& t) { return t.time > 20; }
/// The whole wrench is out. When that is so is the machine's to say: each of its stalls brakes the device.
bool full(const TickRecord& t) { return t.ramp == 1 || late(t); }

}  // namespace

TEST_CASE("Force Dimension servo: ramps up from a held handle and leaves no force behind") {
  dhd_standin::plug({rigid("sigma.7")});
  force_dimension::Device device;
  ScriptedScene scene = pushing();
  ServoLoop loop(device, scene, Registration{});
  CHECK(loop.warnings().empty());
  for (int run = 0; run < 2; ++run) {
    const RunReport report = loop.run_until(full);
    CHECK(report.end == RunEnd::kFinished);
    CHECK(report.zeroed);
    CHECK(seen().most_force == near(2));
    CHECK(seen().most_torque == near(0.01));
    CHECK(seen().felt == Wrenchd::zero());
    CHECK(seen().command == Wrenchd::zero());
  }
}

TEST_CASE("Force Dimension servo: every fault of another moment ends the run without force and says what to do") {
  for (const Fault fault : {Fault::kUnplugged, Fault::kCommunication, Fault::kNoNumber, Fault::kStale, Fault::kError}) {
    CAPTURE(static_cast<int>(fault));
    dhd_standin::plug({rigid("sigma.7")});
    force_dimension::Device device;
    ScriptedScene scene = pushing();
    std::atomic<bool> out{false};
    std::atomic<double> began{0};
    std::thread other([&] {
      while (!out.load()) std::this_thread::yield();
      began.store(dhd_standin::now());
      dhd_standin::inject(fault);
    });
    const RunReport report = ServoLoop{device, scene, Registration{}}.run_until([&](const TickRecord& t) {
      if (full(t)) out.store(true);
      return late(t);
    });
    out.store(true);
    other.join();
    CHECK(report.end == RunEnd::kFault);
    CHECK(report.reason.find(": ") != std::string::npos);
    const bool reached = fault != Fault::kUnplugged && fault != Fault::kCommunication;
    CHECK(report.zeroed == reached);
    std::this_thread::sleep_for(std::chrono::milliseconds(11));  // the watchdog of what cannot be reached
    CHECK(seen().felt == Wrenchd::zero());
    // 10 ms; on a stalled machine a command of a pose of up to 8 ms may still come in, which the watchdog then ends.
    CHECK(seen().felt_until - began.load() <= 0.020);
  }
}

TEST_CASE("Force Dimension servo: a brake is survived: zero, then a ramp") {
  dhd_standin::plug({rigid("sigma.7")});
  force_dimension::Device device;
  ScriptedScene scene = pushing();
  bool pressed = false, again = false;
  std::vector<double> sent;  // from the tick after the one that released the brake
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_until([&](const TickRecord& t) {
    if (!pressed && t.ramp == 1) {
      dhd_standin::press_force_button();
      pressed = true;
    } else if (pressed && !again && t.read_status == DeviceStatus::kSafetyTrip) {
      dhd_standin::press_force_button();
      again = true;
    } else if (again) {
      sent.push_back(t.sent.force.norm());
    }
    return late(t) || (again && t.ramp == 1);
  });
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.ramps >= 2);
  REQUIRE(sent.size() > 2);
  CHECK(sent.front() == 0);
  // Up and up; a stall of the machine may take it to the beginning.
  for (std::size_t i = 1; i < sent.size(); ++i) CHECK((sent[i] == 0 || sent[i] > sent[i - 1]));
  CHECK(sent.back() == near(2));
}
