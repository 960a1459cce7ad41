// SPDX-License-Identifier: MIT
// The servo loop in real time: paced here, or called by a device with a thread of its own; stopped from elsewhere.
// Only what holds on a busy machine is checked; times are reported, not judged.
#include <doctest/doctest.h>

#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>

#include "device/archetypes.hpp"
#include "support/near.hpp"

#include <atomic>
#include <chrono>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

using namespace trephine;
using test::near;
using namespace std::chrono_literals;
using test::FloorScene;
using test::ScriptedScene;

struct PolledDevice {
  Wrenchd last;
  int writes = 0;
  std::chrono::microseconds slow{0};  // reading blocks for so long
  DeviceCapabilities capabilities() const { return {.name = "polled"}; }
  DeviceStatus read(DeviceState&) noexcept {
    if (slow.count() > 0) sleep_until(ServoClock::now() + slow);
    return DeviceStatus::kOk;
  }
  DeviceStatus write(const Wrenchd& wrench) noexcept {
    last = wrench;
    ++writes;
    return DeviceStatus::kOk;
  }
};

/// Calls from its own thread, and commits in frames as OpenHaptics does: a read opens one, a write closes it, anything
/// out of order is an error.
class CallingDevice {
 public:
  std::chrono::microseconds period{1000};
  int silent_after = -1;  // calls, then it hangs
  bool starts = true;
  bool insists = false;      // calls three times more after its last call
  double own_time_step = 0;  // > 0: reports its own time
  int fault_at = -1;         // the write of this call
  // Written by the device's thread, read after stop().
  int calls = 0, reads = 0, errors = 0, stops = 0, refused_calls = 0;
  Wrenchd felt;

  ~CallingDevice() { stop(); }

  DeviceCapabilities capabilities() const { return {.name = "calling", .rate = 1000}; }

  DeviceStatus start(ServoCallback callback, void* user) noexcept {
    if (!starts) return DeviceStatus::kFault;
    running_ = true;
    thread_ = std::thread([this, callback, user] { serve(callback, user); });
    return DeviceStatus::kOk;
  }
  void stop() noexcept {
    ++stops;
    running_ = false;
    if (thread_.joinable()) thread_.join();
  }
  DeviceStatus read(DeviceState& state) noexcept {
    ++reads;
    if (open_) ++errors;
    open_ = true;
    felt = Wrenchd::zero();
    if (own_time_step > 0) state.time = own_time_step * calls;
    return DeviceStatus::kOk;
  }
  DeviceStatus write(const Wrenchd& wrench) noexcept {
    if (!open_) {
      ++errors;
      return DeviceStatus::kFault;
    }
    open_ = false;
    felt = wrench;
    return calls == fault_at ? DeviceStatus::kFault : DeviceStatus::kOk;
  }

 private:
  void serve(ServoCallback callback, void* user) {
    bool wanted = true;
    for (auto due = ServoClock::now(); insists ? refused_calls < 3 : running_ && wanted; due += period) {
      sleep_until(due);
      if (silent_after >= 0 && calls >= silent_after) continue;
      const bool more = callback(user);
      if (open_) ++errors;
      if (!wanted) ++refused_calls;
      wanted = wanted && more;
      ++calls;
    }
    felt = Wrenchd::zero();
  }

  std::thread thread_;
  std::atomic<bool> running_{false};
  bool open_ = false;
};
static_assert(SelfPacedDevice<CallingDevice>);

TEST_CASE("servo loop, real time: 0.3 s at 1 kHz") {
  SimulatedDevice device(SimulatedDeviceOptions{}, [](double) { return Posed(Eigen::Translation3d(0, 0, -0.004)); });
  FloorScene scene;
  double travelled = 0;
  const auto begin = ServoClock::now();
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(
      300ms, [&](const TickRecord& t) { travelled += t.index > 0 ? t.dt : 0; });
  const double took = std::chrono::duration<double>(ServoClock::now() - begin).count();
  std::ostringstream text;
  text << report;
  MESSAGE(text.str());
  CHECK(report.end == RunEnd::kFinished);
  CHECK(took >= 0.298);
  CHECK(report.ticks + report.missed_deadlines >= 250);
  CHECK(report.ticks <= 302);
  CHECK(report.tick_time.count == report.ticks);
  CHECK(report.lateness.count == report.ticks);
  CHECK(report.tick_time.max >= report.tick_time.p50);
  CHECK_FALSE(report.priority.empty());
  // dt is measured: together they are the time that passed (the simulated device has lived it too).
  CHECK(travelled == near(device.time(), 1e-9));
  CHECK(travelled <= report.wall_time);
  if (report.stalls == 0) CHECK(travelled >= 0.298);
  CHECK(device.applied() == Wrenchd::zero());
}

TEST_CASE("servo loop, real time: sleep then spin keeps 5 kHz") {
  PolledDevice device;
  ScriptedScene scene;
  ServoOptions options;
  options.rate = 5000;
  options.realtime.priority = 0;
  ServoLoop loop(device, scene, Registration{}, options, SleepSpinPacing{});
  const RunReport report = loop.run_for(100ms);
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.ticks <= 502);
  CHECK(report.ticks + report.missed_deadlines >= 400);
  CHECK(report.priority == "no real-time priority requested");
  CHECK(device.last == Wrenchd::zero());
}

TEST_CASE("servo loop, real time: ticks longer than the period count as missed, and do not bunch") {
  PolledDevice device;
  device.slow = 2500us;
  ScriptedScene scene;
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(100ms);
  CHECK(report.missed_deadlines >= 2 * (report.ticks - 1));
  CHECK(report.ticks <= 41);
  CHECK(report.tick_time.p50 >= 2.5e-3);
}

TEST_CASE("servo loop, real time: a stall starts the ramp anew, and dt is clamped") {
  PolledDevice device;
  ScriptedScene scene;
  ServoOptions options;
  options.ramp = 0.005;
  int tick_of_stall = -1;
  double dt = 0, ramp = -1;
  const RunReport report = ServoLoop{device, scene, Registration{}, options}.run_until([&](const TickRecord& t) {
    const int index = static_cast<int>(t.index);
    if (t.ramp == 1.0 && tick_of_stall < 0) {
      std::this_thread::sleep_for(150ms);
      tick_of_stall = index + 1;
    }
    if (index == tick_of_stall) {
      dt = t.dt;
      ramp = t.ramp;
    }
    return index == tick_of_stall || t.time > 10;
  });
  CHECK(report.stalls >= 1);
  CHECK(dt == kLongestDt);
  CHECK(ramp == 0.0);
  CHECK(report.ramps >= 2);
  CHECK(report.missed_deadlines >= 149);
}

TEST_CASE("servo loop, real time: stopped from another thread") {
  PolledDevice device;
  ScriptedScene scene;
  ServoLoop loop(device, scene, Registration{});
  std::thread other([&] {
    std::this_thread::sleep_for(30ms);
    loop.stop();
  });
  const RunReport report = loop.run_until([](const TickRecord&) { return false; });
  other.join();
  CHECK(report.end == RunEnd::kStopped);
  CHECK(report.reason == "stop was called");
  CHECK(report.zeroed);
  CHECK(device.last == Wrenchd::zero());
  CHECK(device.writes == static_cast<int>(report.ticks) + 1);
}

TEST_CASE("self-paced device: ticks in its calls, in whole frames, and the last call is the zero") {
  CallingDevice device;
  ScriptedScene scene;
  std::thread::id ticking;
  const auto begin = ServoClock::now();
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(
      100ms, [&](const TickRecord&) { ticking = std::this_thread::get_id(); });
  const double took = std::chrono::duration<double>(ServoClock::now() - begin).count();
  CHECK(report.end == RunEnd::kFinished);
  // What came late counts as missed, rounded down by less than half a period each.
  CHECK(report.ticks + report.missed_deadlines >= 60);
  // A tick a millisecond since the device was started, though the first be late, until the loop noticed that the time
  // was over: other programs may delay both.
  CHECK(report.wall_time <= took);
  CHECK(static_cast<double>(report.ticks) <= 1000 * took + 1);
  CHECK(device.calls == static_cast<int>(report.ticks) + 1);
  CHECK(device.errors == 0);
  CHECK(device.stops == 1);
  CHECK(device.felt == Wrenchd::zero());
  CHECK(report.zeroed);
  CHECK(ticking != std::this_thread::get_id());
  CHECK(report.tick_time.count == report.ticks);
  CHECK(report.priority.find("device's own thread") != std::string::npos);
}

TEST_CASE("self-paced device: stopped before it began, its only call is the zero") {
  CallingDevice device;
  ScriptedScene scene;
  ServoLoop loop(device, scene, Registration{});
  loop.stop();
  const RunReport report = loop.run_for(1s);
  CHECK(report.end == RunEnd::kStopped);
  CHECK(device.calls == 1);
  CHECK(device.reads == 1);
  CHECK(report.zeroed);
}

TEST_CASE("self-paced device: stopped from another thread, again and again") {
  CallingDevice device;
  device.period = 200us;
  ScriptedScene scene;
  ServoLoop loop(device, scene, Registration{});
  for (int i = 0; i < 5; ++i) {
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(4 * i));
      loop.stop();
    });
    const RunReport report = loop.run_until([](const TickRecord&) { return false; });
    other.join();
    CHECK(report.end == RunEnd::kStopped);
    CHECK(report.zeroed);
  }
  CHECK(device.errors == 0);
}

TEST_CASE("self-paced device: its own time makes dt") {
  CallingDevice device;
  device.own_time_step = 1.25e-3;
  ScriptedScene scene;
  ServoLoop{device, scene, Registration{}}.run_until([&](const TickRecord& t) {
    CHECK(t.dt == near(t.index == 0 ? 1e-3 : 1.25e-3));
    return t.index == 15;
  });
  CHECK(scene.ticks == 16);
}

TEST_CASE("self-paced device: a fault ends the run, the zero goes out in a frame of its own") {
  CallingDevice device;
  device.fault_at = 10;
  ScriptedScene scene;
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(1s);
  CHECK(report.end == RunEnd::kFault);
  CHECK(report.reason == "the device failed to write");
  CHECK(report.ticks == 11);
  CHECK(device.calls == 12);
  CHECK(device.errors == 0);
  CHECK(report.zeroed);
}

TEST_CASE("self-paced device: exceptions of the observer cross to the caller") {
  CallingDevice device;
  ScriptedScene scene;
  ServoLoop loop(device, scene, Registration{});
  CHECK_THROWS_WITH(loop.run_for(1s,
                                 [](const TickRecord& t) {
                                   if (t.index == 5) throw std::runtime_error("log full");
                                 }),
                    "log full");
  CHECK(device.calls == 7);
  CHECK(device.errors == 0);
  CHECK(loop.run_for(20ms).end == RunEnd::kFinished);
}

TEST_CASE("self-paced device: one that goes silent, or never starts, is a fault and does not hang the caller") {
  ScriptedScene scene;
  ServoOptions options;
  options.callback_timeout = 0.1;
  for (const int after : {0, 10}) {
    CallingDevice device;
    device.silent_after = after;
    const RunReport report = ServoLoop{device, scene, Registration{}, options}.run_for(10s);
    CHECK(report.end == RunEnd::kFault);
    CHECK(report.reason == "the device stopped calling");
    // Each of its calls ticked; a machine that stalls for as long may have made it silent before.
    CHECK(report.ticks == static_cast<std::uint64_t>(device.calls));
    CHECK(device.calls <= after);
    CHECK(device.stops == 1);
    CHECK(device.errors == 0);
  }
  CallingDevice device;
  device.starts = false;
  const RunReport report = ServoLoop{device, scene, Registration{}, options}.run_for(10s);
  CHECK(report.end == RunEnd::kFault);
  CHECK(report.reason == "the device did not start");
  CHECK(report.ticks == 0);
  CHECK(device.stops == 1);
}

TEST_CASE("self-paced device: calls after the last one are refused without touching the device") {
  CallingDevice device;
  device.insists = true;
  device.period = 100us;
  ScriptedScene scene;
  const RunReport report = ServoLoop{device, scene, Registration{}}.run_for(20ms);
  CHECK(report.end == RunEnd::kFinished);
  CHECK(device.refused_calls == 3);
  CHECK(device.calls == static_cast<int>(report.ticks) + 4);
  CHECK(device.reads == static_cast<int>(report.ticks) + 1);
  CHECK(device.errors == 0);
}

TEST_CASE("real-time scope: says what was granted, and gives the thread back as it was") {
#if defined(__linux__)
  const int before = sched_getscheduler(0);
  sched_param param_before{}, param_after{};
  sched_getparam(0, &param_before);
#endif
  const RealtimeScope none(RealtimeOptions{.priority = 0});
  CHECK_FALSE(none.granted());
  CHECK(none.text() == "no real-time priority requested");
  {
    const RealtimeScope scope(RealtimeOptions{.priority = 10});
    MESSAGE(scope.text());
#if defined(_WIN32)
    CHECK(scope.granted() == (scope.text() == "time-critical priority"));
#else
    CHECK(scope.granted() == (scope.text() == "real-time priority 10 (SCHED_FIFO)"));
#endif
    CHECK_FALSE(scope.memory_locked());
#if defined(__linux__)
    CHECK(sched_getscheduler(0) == (scope.granted() ? SCHED_FIFO : before));
#endif
  }
#if defined(__linux__)
  CHECK(sched_getscheduler(0) == before);
  sched_getparam(0, &param_after);
  CHECK(param_after.sched_priority == param_before.sched_priority);
#endif
  CHECK_THROWS_AS(RealtimeScope(RealtimeOptions{.priority = 100}), std::invalid_argument);
}

}  // namespace
