// SPDX-License-Identifier: MIT
#include "spacemouse_device.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/device/servo_loop.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "device/archetypes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace spacemouse;

/// Events that a test has written down.
struct Written {
  std::array<Event, 200> events{};
  std::size_t count = 0, at = 0;
  void add(const Event& e) { events[count++] = e; }
  void push(const Deflection& d) { add({.kind = Event::kMotion, .deflection = d}); }
  void button(int number, bool pressed) { add({.kind = Event::kButton, .button = number, .pressed = pressed}); }
  Event next() noexcept { return at < count ? events[at++] : Event{}; }
};

using Mouse = spacemouse::Device<Written>;
static_assert(HapticDevice<Mouse>);
static_assert(!SelfPacedDevice<Mouse>);
static_assert(!AdvancedDevice<Mouse>);

constexpr Gains kGains{.speed = 0.05, .turn = 1.0, .full = 350, .dead = 5};
constexpr double kRounding = 3e-14;

}  // namespace

TEST_CASE("6-DOF mouse: full deflection moves at full speed, each axis its way") {
  const struct {
    Deflection d;
    Vec3d v;
    Vec3d w;
  } cases[] = {
      {{.x = 350}, {0.05, 0, 0}, {0, 0, 0}},      {{.y = 350}, {0, 0.05, 0}, {0, 0, 0}},
      {{.z = 350}, {0, 0, -0.05}, {0, 0, 0}},  // pushed away: -z, toward the user is +z
      {{.x = -175}, {-0.025, 0, 0}, {0, 0, 0}},   {{.rx = 350}, {0, 0, 0}, {1, 0, 0}},
      {{.ry = 350}, {0, 0, 0}, {0, 1, 0}},        {{.rz = 350}, {0, 0, 0}, {0, 0, -1}},
      {{.x = 5, .ry = -5}, {0, 0, 0}, {0, 0, 0}},  // rest is never quite zero
  };
  for (const auto& c : cases) {
    RateIntegrator integrator(kGains);
    integrator.deflect(c.d);
    for (int i = 0; i < 500; ++i) integrator.advance(1e-3);
    CHECK((integrator.pose().translation() - 0.5 * c.v).norm() < kRounding);
    CHECK((rotation_vector<double>(integrator.pose().linear()) - 0.5 * c.w).norm() < kRounding);
  }
}

TEST_CASE("6-DOF mouse: moves and turns are about the device's axes, wherever the tool points") {
  const Mat3d R = rotation_from_vector<double>(Vec3d(0, 0, std::numbers::pi / 2));
  RateIntegrator integrator(kGains, make_pose<double>(R, Vec3d(0, 0, 1)));
  integrator.deflect({.x = 350, .rx = 350});
  integrator.advance(0.1);
  CHECK((integrator.pose().translation() - Vec3d(0.005, 0, 1)).norm() < kRounding);
  CHECK((integrator.pose().linear() - rotation_from_vector<double>(Vec3d(0.1, 0, 0)) * R).norm() < kRounding);
}

TEST_CASE("6-DOF mouse: stays a rotation for an hour") {
  RateIntegrator integrator(kGains);
  integrator.deflect({.rx = 200, .ry = -310, .rz = 90});
  for (int i = 0; i < 3'600'000; i += 10) integrator.advance(1e-2);
  const Mat3d R = integrator.pose().linear();
  CHECK((R.transpose() * R - Mat3d::Identity()).norm() < 3.4e-15);
}

TEST_CASE("6-DOF mouse: a deflection holds until the next; buttons are bits") {
  Written source;
  Mouse mouse(source, kGains);
  DeviceState state;
  source.push({.x = 350});
  source.button(0, true);
  source.button(3, true);
  CHECK(mouse.read_after(0.01, state) == DeviceStatus::kOk);
  CHECK(state.X_DH.translation().x() == 0);  // the push came after the time had passed
  CHECK(state.buttons == 9);
  CHECK(mouse.read_after(0.01, state) == DeviceStatus::kOk);
  CHECK(mouse.read_after(0.01, state) == DeviceStatus::kOk);
  CHECK(state.X_DH.translation().x() == near(0.001));
  source.push({});
  source.button(0, false);
  source.button(40, true);  // more than there are bits
  source.button(-1, true);
  CHECK(mouse.read_after(0.0, state) == DeviceStatus::kOk);
  CHECK(mouse.read_after(5.0, state) == DeviceStatus::kOk);
  CHECK(state.X_DH.translation().x() == near(0.001));
  CHECK(state.buttons == 8);
  CHECK_FALSE(state.time.has_value());
}

TEST_CASE("6-DOF mouse: no leap after a pause, none backward, and only so much work a tick") {
  Written source;
  Mouse mouse(source, kGains);
  DeviceState state;
  source.push({.x = 350});
  (void)mouse.read_after(0, state);
  (void)mouse.read_after(60, state);
  CHECK(state.X_DH.translation().x() == near(0.05 * Mouse::kLongestStep));
  (void)mouse.read_after(-1, state);
  CHECK(state.X_DH.translation().x() == near(0.05 * Mouse::kLongestStep));
  for (int i = 0; i < Mouse::kMaxEvents + 10; ++i) source.button(1, i % 2 == 0);
  const std::size_t before = source.at;
  (void)mouse.read_after(0.001, state);
  CHECK(source.at - before == Mouse::kMaxEvents);
  (void)mouse.read_after(0.001, state);
  CHECK(source.at == source.count);
}

TEST_CASE("6-DOF mouse: a driver that is gone is a fault, for good, that says what to do") {
  Written source;
  Mouse mouse(source, kGains);
  DeviceState state;
  source.add({.kind = Event::kLost});
  source.push({.x = 1});
  CHECK(mouse.fault_text().empty());
  CHECK(mouse.read_after(0.001, state) == DeviceStatus::kFault);
  CHECK(mouse.read_after(0.001, state) == DeviceStatus::kFault);
  CHECK(mouse.fault_text().find("spacenavd") != std::string::npos);
}

TEST_CASE("6-DOF mouse: has no output, the loop says so, and runs it") {
  Written source;
  Mouse mouse(source, kGains);
  CHECK(mouse.capabilities().output_dof == 0);
  CHECK(mouse.write({Vec3d(1, 2, 3), Vec3d::Zero()}) == DeviceStatus::kOk);
  CHECK(mouse.write({Vec3d(0, std::numeric_limits<double>::quiet_NaN(), 0), Vec3d::Zero()}) == DeviceStatus::kFault);
  test::FloorScene scene;
  source.push({.y = 350});
  ServoLoop loop(mouse, scene, Registration{});
  CHECK(loop.warnings().size() == 1);
  CHECK(loop.warnings()[0].find("gives no force") != std::string::npos);
  double y = 0;
  std::int64_t calls = 0;
  const test::AllocationGuard guard;
  const RunReport report = loop.run_for(std::chrono::milliseconds(100), [&](const TickRecord& t) {
    y = t.state.X_DH.translation().y();
    if (t.index == 0) calls = -guard.allocations();
    if (t.index == 50) calls += guard.allocations();
    CHECK_FALSE(t.sent.force.norm() > 0);
  });
  CHECK(report.end == RunEnd::kFinished);
  CHECK(y > 0.002);
  CHECK(y < 0.0055);
  source.add({.kind = Event::kLost});
  const RunReport lost = loop.run_for(std::chrono::milliseconds(100));
  CHECK(lost.end == RunEnd::kFault);
  CHECK(lost.reason.find("spacenavd") != std::string::npos);
}
