// SPDX-License-Identifier: MIT
// The servo loop in simulated time: what reaches the hand, tick by tick.
#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>

#include "device/archetypes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using test::near;
using namespace std::chrono_literals;
using test::FloorScene;
using test::Moment;
using test::ScriptedDevice;
using test::ScriptedScene;

constexpr auto kStill = [](int) { return Moment{}; };
constexpr double kSums = 1e-12;  // rounding of a sum of some hundred periods

template <class Device, class Scene>
auto simulated(Device& device, Scene& scene, ServoOptions options = {}, const Registration& registration = {}) {
  return ServoLoop<Device, Scene, NoPacing>(device, scene, registration, options);
}

TEST_CASE("servo loop: reads, ticks and writes once a tick, and closes with zero") {
  ScriptedDevice device(kStill);
  ScriptedScene scene;
  auto loop = simulated(device, scene);
  const RunReport report = loop.run_for(250ms);
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.reason == "the duration is over");
  CHECK(report.ticks == 250);
  CHECK(scene.ticks == 250);
  CHECK(device.reads == 251);
  CHECK(device.writes == 251);
  CHECK(device.advances == 249);
  CHECK(device.last() == Wrenchd::zero());
  CHECK(report.zeroed);
  CHECK(scene.last_dt == 1e-3);
  CHECK(report.scene_time == near(0.25));
  CHECK(device.advanced == near(0.249));
  CHECK(report.tick_time.count == 250);
  CHECK(report.lateness.count == 0);
  CHECK(report.ramps == 1);
  std::ostringstream text;
  text << report;
  CHECK(text.str().find("finished: the duration is over\n  250 ticks") == 0);
}

TEST_CASE("servo loop: a handle that leaps farther than a hand moves gets zero and a ramp") {
  for (const double leap : {9.9e-3, 10.1e-3}) {  // a hand's 5 m/s in a millisecond, and 5 mm
    ScriptedDevice device([leap](int n) {
      Moment moment;
      moment.X_DH.translation().x() = n < 150 ? 0 : leap;
      return moment;
    });
    ScriptedScene scene;  // one wrench, whatever the pose
    auto loop = simulated(device, scene);
    std::vector<double> forces;
    const RunReport report = loop.run_for(400ms, [&](const TickRecord& t) { forces.push_back(t.sent.force.norm()); });
    const bool is_leap = leap > 10e-3;
    CHECK(report.leaps == (is_leap ? 1 : 0));
    CHECK(report.ramps == (is_leap ? 2 : 1));
    CHECK((forces[150] == 0) == is_leap);
    CHECK(forces[149] > 3);
    CHECK(forces[200] > (is_leap ? 1 : 3));
    CHECK((forces[200] < 2.5) == is_leap);
    CHECK(forces[399] > 3);
  }
}

TEST_CASE("servo loop: duration, rate and condition") {
  ScriptedDevice device(kStill);
  device.can.rate = 4000;
  ScriptedScene scene;
  auto loop = simulated(device, scene);
  CHECK(loop.period() == 1.0 / 4000);
  CHECK(loop.run_for(10ms).ticks == 40);
  CHECK(loop.run_for(0ms).ticks == 0);
  CHECK(loop.run_for(100us).ticks == 0);  // to the nearest period
  CHECK(loop.run_for(130us).ticks == 1);
  CHECK(loop.run_for(1100us).ticks == 4);
  CHECK(loop.run_for(1150us).ticks == 5);
  CHECK(simulated(device, scene, {.rate = 500}).run_for(10ms).ticks == 5);
  CHECK_THROWS_AS(loop.run_for(-1ms), std::invalid_argument);
  CHECK_THROWS_AS(loop.run_for(std::chrono::duration<double>(std::numeric_limits<double>::quiet_NaN())),
                  std::invalid_argument);
  std::uint64_t seen = 0;
  const RunReport report = loop.run_until([](const TickRecord& t) { return t.index == 16; },
                                          [&](const TickRecord& t) {
                                            CHECK(t.index == seen++);
                                            CHECK(t.time == static_cast<double>(t.index) * loop.period());
                                          });
  CHECK(report.ticks == 17);
  CHECK(seen == 17);
  CHECK(report.reason == "the condition is true");
}

TEST_CASE("servo loop: the wrench comes in over the ramp, linearly, from zero") {
  ScriptedDevice device(kStill);
  ScriptedScene scene;
  auto loop = simulated(device, scene);
  loop.run_for(200ms);
  for (int i = 0; i < 200; ++i) {
    const double gain = i < 100 ? i * 0.01 : 1.0;
    const Wrenchd& sent = device.wrote[static_cast<std::size_t>(i)];
    CAPTURE(i);
    CHECK((sent.force - gain * scene.wrench.force).norm() < kSums);
    CHECK((sent.torque - gain * scene.wrench.torque).norm() < kSums);
  }
  CHECK(device.wrote[0] == Wrenchd::zero());
  CHECK(device.wrote[150] == scene.wrench);  // full means full, to the bit
  // Every run has its own.
  loop.run_for(50ms);
  CHECK(device.wrote[201] == Wrenchd::zero());
  CHECK(device.wrote[202].force.norm() < 0.011 * scene.wrench.force.norm());
}

TEST_CASE("servo loop: statuses that ask for it start the ramp anew, others do not") {
  for (const Status status : {Status::kWorkBound, Status::kStartedInside, Status::kJump, Status::kBadInput}) {
    static Status once;
    once = status;
    ScriptedDevice device(kStill);
    ScriptedScene scene;
    scene.status = [](int tick) { return tick == 150 ? once : Status::kOk; };
    auto loop = simulated(device, scene, {.ramp = 0.02});
    const RunReport report = loop.run_for(200ms);
    CAPTURE(to_string(status));
    const double at = device.wrote[150].force.norm(), next = device.wrote[151].force.norm();
    const double full = scene.wrench.force.norm();
    CHECK(device.wrote[149].force.norm() == full);
    if (status == Status::kWorkBound) {
      CHECK(at == full);
      CHECK(report.ramps == 1);
    } else {
      CHECK(at == 0.0);
      CHECK(next == near(full * 0.05));
      CHECK(device.wrote[160].force.norm() == near(full * 0.5));
      CHECK(device.wrote[171].force.norm() == full);
      CHECK(report.ramps == 2);
    }
  }
}

TEST_CASE("servo loop: no ramp longer than asked for; none still starts at zero") {
  ScriptedDevice device(kStill);
  ScriptedScene scene;
  simulated(device, scene, {.ramp = 0}).run_for(3ms);
  CHECK(device.wrote[0] == Wrenchd::zero());
  CHECK(device.wrote[1] == scene.wrench);
}

TEST_CASE("servo loop: a safety trip at reading: zero while it lasts, the scene goes on, then a ramp") {
  ScriptedDevice device(
      [](int n) { return Moment{.read = n >= 50 && n < 60 ? DeviceStatus::kSafetyTrip : DeviceStatus::kOk}; });
  ScriptedScene scene;
  const RunReport report = simulated(device, scene, {.ramp = 0.01}).run_for(100ms);
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.safety_trips == 10);
  CHECK(scene.ticks == 100);
  CHECK(device.wrote[49] == scene.wrench);
  for (std::size_t i = 50; i < 60; ++i) CHECK(device.wrote[i] == Wrenchd::zero());
  CHECK(device.wrote[60].force.norm() == near(0.1 * scene.wrench.force.norm()));
  CHECK(device.wrote[70] == scene.wrench);
  CHECK(report.ramps == 2);
}

TEST_CASE("servo loop: a safety trip at writing: zero from the next tick until a write is taken again") {
  for (const double ramp : {0.01, 0.0}) {
    ScriptedDevice device(
        [](int n) { return Moment{.write = n >= 50 && n < 60 ? DeviceStatus::kSafetyTrip : DeviceStatus::kOk}; });
    ScriptedScene scene;
    const RunReport report = simulated(device, scene, {.ramp = ramp}).run_for(100ms);
    CHECK(report.safety_trips == 10);
    CHECK(device.wrote[50] == scene.wrench);  // nobody could know
    for (std::size_t i = 51; i <= 60; ++i) CHECK(device.wrote[i] == Wrenchd::zero());
    CHECK(device.wrote[61].force.norm() == near((ramp > 0 ? 0.1 : 1.0) * scene.wrench.force.norm()));
    CHECK(scene.ticks == 100);
  }
}

TEST_CASE("servo loop: a fault at reading ends the run with zero, without a tick of the scene") {
  ScriptedDevice device([](int n) { return Moment{.read = n >= 30 ? DeviceStatus::kFault : DeviceStatus::kOk}; });
  ScriptedScene scene;
  const RunReport report = simulated(device, scene).run_for(100ms);
  CHECK(report.end == RunEnd::kFault);
  CHECK(report.reason == "the device failed to read");
  ScriptedDevice closed([](int) { return Moment{.read = DeviceStatus::kFault}; });
  CHECK(simulated(closed, scene).run_for(100ms).reason.find("is it connected and opened?") != std::string::npos);
  CHECK(report.ticks == 30);
  CHECK(scene.ticks == 30);
  CHECK(device.wrote[30] == Wrenchd::zero());
  CHECK(device.last() == Wrenchd::zero());
  CHECK(device.reads == device.writes);
  CHECK(report.zeroed);
}

TEST_CASE("servo loop: a fault at writing ends the run; the zero is tried again, at the end and with the loop") {
  struct Lost : ScriptedDevice<Moment (*)(int)> {
    using ScriptedDevice::ScriptedDevice;
    [[nodiscard]] std::string fault_text() const { return "cable pulled"; }
  };
  Lost device([](int n) { return Moment{.write = n >= 30 ? DeviceStatus::kFault : DeviceStatus::kOk}; });
  ScriptedScene scene;
  int writes_after_run = 0;
  {
    auto loop = simulated(device, scene);
    const RunReport report = loop.run_for(100ms);
    CHECK(report.end == RunEnd::kFault);
    CHECK(report.reason == "the device failed to write: cable pulled");
    CHECK(report.ticks == 31);
    CHECK_FALSE(report.zeroed);
    CHECK(device.writes == 33);
    CHECK(device.wrote[30] != Wrenchd::zero());
    CHECK(device.wrote[31] == Wrenchd::zero());
    CHECK(device.wrote[32] == Wrenchd::zero());
    writes_after_run = device.writes;
    std::ostringstream text;
    text << report;
    CHECK(text.str().find("did not take the closing zero") != std::string::npos);
  }
  CHECK(device.writes == writes_after_run + 1);
  CHECK(device.last() == Wrenchd::zero());
}

TEST_CASE("servo loop: exceptions end with zero and come to the caller; the loop can run again") {
  ScriptedDevice device(kStill);
  ScriptedScene scene;
  auto loop = simulated(device, scene, {.ramp = 0});
  CHECK_THROWS_WITH_AS(loop.run_for(100ms,
                                    [](const TickRecord& t) {
                                      if (t.index == 20) throw std::runtime_error("log full");
                                    }),
                       "log full", std::runtime_error);
  CHECK(device.wrote[20] == scene.wrench);
  CHECK(device.wrote[21] == Wrenchd::zero());
  CHECK(device.writes == 22);
  CHECK_THROWS_AS(loop.run_until([](const TickRecord&) -> bool { throw 5; }), int);
  CHECK(device.last() == Wrenchd::zero());
  CHECK(loop.run_for(10ms).end == RunEnd::kFinished);

  SimulatedDevice scripted(SimulatedDeviceOptions{}, [](double t) -> Posed {
    if (t > 0.05) throw std::runtime_error("end of script");
    return Posed::Identity();
  });
  auto other = simulated(scripted, scene);
  CHECK_THROWS_WITH(other.run_for(100ms), "end of script");
  CHECK(scripted.applied() == Wrenchd::zero());
}

TEST_CASE("servo loop: a wrench or pose that is no number never reaches the device, and is followed by a ramp") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  {
    struct Broken : ScriptedScene {
      TickResult tick(const TickInput& input, double dt) noexcept {
        TickResult r = ScriptedScene::tick(input, dt);
        if (ticks == 21) r.wrench.torque.y() = std::numeric_limits<double>::infinity();
        return r;
      }
    } scene;
    ScriptedDevice device(kStill);
    const RunReport report = simulated(device, scene, {.ramp = 0.01}).run_for(40ms);
    CHECK(device.wrote[19] == scene.wrench);
    CHECK(device.wrote[20] == Wrenchd::zero());
    CHECK(device.wrote[21].force.norm() == near(0.1 * scene.wrench.force.norm()));
    CHECK(report.end == RunEnd::kFinished);
    CHECK(report.ramps == 2);
  }
  {
    ScriptedDevice device([nan](int n) {
      Moment m;
      if (n == 20) m.X_DH.linear()(0, 1) = nan;
      return m;
    });
    ScriptedScene scene;
    simulated(device, scene, {.ramp = 0.01}, Registration(Posed::Identity(), Posed(Eigen::Translation3d(0, 0, 0.1))))
        .run_for(40ms);
    CHECK(scene.ticks == 40);
    CHECK(device.wrote[20] == Wrenchd::zero());
    for (int i = 0; i < device.writes; ++i) CHECK(is_finite(device.wrote[static_cast<std::size_t>(i)]));
  }
}

TEST_CASE("servo loop: the device's means limit the wrench, before the ramp") {
  ScriptedDevice device(kStill);
  device.can.max_force = 3.3;
  device.can.max_torque = 0.1;
  ScriptedScene scene;
  scene.wrench = {Vec3d(0, 300, 400), Vec3d(0, 0, 0.05)};
  const Registration registration(Posed::Identity(), Posed(Eigen::Translation3d(0.1, 0, 0)));
  const RunReport report = simulated(device, scene, {}, registration).run_for(150ms);
  CHECK((device.wrote[140].force - 3.3 * Vec3d(0, 0.6, 0.8)).norm() < 1e-14);
  CHECK(device.wrote[140].torque.norm() == near(0.1));  // of 50 N·m by the arm
  CHECK(device.wrote[1].force.norm() == near(0.033));
  CHECK(report.limited == 150);
  scene.wrench = {Vec3d(0, 3e200, 0), Vec3d::Zero()};
  simulated(device, scene, {}, registration).run_for(150ms);
  CHECK(device.wrote[static_cast<std::size_t>(device.writes - 5)].force.norm() == near(3.3));
}

TEST_CASE("servo loop: three output degrees of freedom get no torque, none get nothing") {
  for (const int dof : {0, 3, 6}) {
    ScriptedDevice device(kStill);
    device.can.output_dof = dof;
    ScriptedScene scene;
    const RunReport report = simulated(device, scene, {.ramp = 0}).run_for(10ms);
    CHECK(device.wrote[5].force == (dof >= 3 ? scene.wrench.force : Vec3d::Zero()));
    CHECK(device.wrote[5].torque == (dof == 6 ? scene.wrench.torque : Vec3d::Zero()));
    CHECK(report.limited == 0);
  }
}

TEST_CASE("servo loop: says where scene and device do not fit") {
  const auto warned = [](const auto& loop, const char* part) {
    int n = 0;
    for (const std::string& w : loop.warnings()) n += w.find(part) != std::string::npos;
    return n == 1;
  };
  ScriptedDevice device(kStill);
  FloorScene scene;
  CHECK(simulated(device, scene).warnings().empty());
  struct WarningScene : FloorScene {
    std::vector<std::string> warnings() const { return {"the bone is a cheese"}; }
  } warning;
  CHECK(warned(simulated(device, warning), "cheese"));
  device.can.output_dof = 3;
  CHECK(warned(simulated(device, warning), "cheese"));
  CHECK(warned(simulated(device, scene), "torque is dropped"));
  device.can.output_dof = 0;
  CHECK(warned(simulated(device, scene), "gives no force"));
  CHECK_FALSE(warned(simulated(device, scene), "torque is dropped"));
  device.can = {.input_dof = 3, .output_dof = 3};
  CHECK(warned(simulated(device, scene), "reads no rotation"));
  test::ForceOnlyFloorScene force_only;
  CHECK_FALSE(warned(simulated(device, force_only), "torque"));
  device.can = {};
  CHECK(warned(simulated(device, force_only), "computes no torque"));
  device.can.stiffness = 400;
  CHECK(warned(simulated(device, scene), "felt stiffness is 500 N/m"));
  struct Stiffening : FloorScene {
    double tangent_stiffness(double force) const { return force > 0 ? 50 * force : 390; }
  } stiffening;
  CHECK_FALSE(warned(simulated(device, stiffening), "felt stiffness"));
  device.can.max_force = 9;
  CHECK(warned(simulated(device, stiffening), "felt stiffness is 450 N/m (scale 1, as a tangent)"));
  device.can.max_force = 0;
  const Registration half(Posed::Identity(), Posed::Identity(), 0.5);
  CHECK_FALSE(warned(simulated(device, scene, {}, half), "felt stiffness"));
  device.can = {.rate = 1000};
  CHECK(warned(simulated(device, scene, {.rate = 100}), "100 Hz"));
}

TEST_CASE("servo loop: poses, buttons and wrenches go through the registration") {
  const Registration registration(
      make_pose<double>(rotation_from_vector<double>(Vec3d(0.3, -1, 0.2)), Vec3d(0.1, 0.2, 0.3)),
      Posed(Eigen::Translation3d(0, 0.01, -0.1)), 0.7);
  ScriptedDevice device([](int n) {
    return Moment{
        .X_DH = make_pose<double>(rotation_from_vector<double>(Vec3d(0.01 * n, 0, 0.2)), Vec3d(0, 1e-3 * n, 0)),
        .buttons = n % 2 ? 4u : 3u};
  });
  ScriptedScene scene;
  auto loop = simulated(device, scene, {.ramp = 0, .spindle_buttons = 4}, registration);
  loop.run_for(20ms, [&](const TickRecord& t) {
    CHECK(t.input.X_WT.matrix() == registration.tool_pose(t.state.X_DH).matrix());
    CHECK(t.input.spindle_on == (t.index % 2 == 1));
    CHECK(scene.last.spindle_on == t.input.spindle_on);
    if (t.index > 0) CHECK(t.sent == registration.device_wrench(scene.wrench, t.state.X_DH));
    CHECK(t.sent == device.last());
    CHECK(t.result.wrench == scene.wrench);
    CHECK(t.ramp == (t.index > 0 ? 1.0 : 0.0));
  });
}

TEST_CASE("servo loop: stop before a run ends it at once, and only that one") {
  ScriptedDevice device(kStill);
  ScriptedScene scene;
  auto loop = simulated(device, scene);
  loop.stop();
  const RunReport report = loop.run_for(10ms);
  CHECK(report.end == RunEnd::kStopped);
  CHECK(report.ticks == 0);
  CHECK(device.last() == Wrenchd::zero());
  CHECK(loop.run_for(10ms).ticks == 10);
  const RunReport inside = loop.run_for(10ms, [&](const TickRecord& t) {
    if (t.index == 4) loop.stop();
  });
  CHECK(inside.end == RunEnd::kStopped);
  CHECK(inside.ticks == 5);
}

TEST_CASE("servo loop: closed loop with the simulated device comes to rest on the floor") {
  SimulatedDevice device(SimulatedDeviceOptions{}, [](double) { return Posed(Eigen::Translation3d(0, 0, -0.004)); });
  FloorScene scene;
  const RunReport report = simulated(device, scene).run_for(2s);
  CHECK(report.end == RunEnd::kFinished);
  // The hand's 400 N/m against the floor's 500 N/m; friction and a quantum of 0.055 mm leave it within a band.
  const double balance = -0.004 * 400 / 900, band = (0.05 + 500 * 0.055e-3) / 900;
  CHECK(std::abs(device.X_DH().translation().z() - balance) < band);
}

TEST_CASE("servo loop: two runs have the same bits") {
  const auto end = [] {
    SimulatedDevice device(SimulatedDeviceOptions{}, [](double t) {
      return make_pose<double>(rotation_from_vector<double>(Vec3d(0.4 * std::sin(8 * t), 0, t)),
                               Vec3d(0, 0.01 * t, 0.003 * std::cos(20 * t)));
    });
    FloorScene scene;
    Mat3d sum = Mat3d::Zero();
    simulated(device, scene).run_for(1s, [&](const TickRecord& t) {
      sum.col(0) += t.sent.force;
      sum.col(1) += t.sent.torque;
      sum.col(2) += t.state.X_DH.translation();
    });
    return sum;
  };
  const Mat3d first = end();
  CHECK(first.col(0).norm() > 1);
  CHECK(first == end());
}

TEST_CASE("servo loop: nothing is allocated between the first tick and the closing zero") {
  if (!test::AllocationGuard::available()) return;
  SimulatedDevice device(SimulatedDeviceOptions{}, [](double t) {
    return make_pose<double>(rotation_from_vector<double>(Vec3d(0.4 * std::sin(8 * t), 0, t)),
                             Vec3d(0, 0.01 * t, 0.003 * std::cos(20 * t)));
  });
  FloorScene scene;
  const auto cost = [&](auto&& loop, std::chrono::milliseconds duration) {
    // From inside the first tick to inside the last.
    std::int64_t before = 0, after = 0;
    const test::AllocationGuard guard;
    loop.run_for(duration, [&](const TickRecord& t) {
      if (t.index == 0) before = guard.allocations() + guard.frees();
      after = guard.allocations() + guard.frees();
    });
    return after - before;
  };
  CHECK(cost(simulated(device, scene), 300ms) == 0);
  CHECK(cost(ServoLoop{device, scene, Registration{}}, 50ms) == 0);
}

TEST_CASE("servo loop: refuses options that make no sense") {
  ScriptedDevice device(kStill);
  ScriptedScene scene;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](ServoOptions o) { CHECK_THROWS_AS(simulated(device, scene, o), std::invalid_argument); };
  refused({.rate = -5});
  refused({.rate = nan});
  refused({.rate = 1e6});
  refused({.rate = 1});
  refused({.ramp = -1});
  refused({.ramp = nan});
  refused({.stall_time = 0});
  refused({.callback_timeout = nan});
  refused({.realtime = {.priority = 100}});
}

}  // namespace
