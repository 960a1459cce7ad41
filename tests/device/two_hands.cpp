// SPDX-License-Identifier: MIT
// Two hands in one thread: the order of their ticks, and the zero that ends both.
#include <doctest/doctest.h>

#include <trephine/device/simulated_device.hpp>
#include <trephine/device/two_hands.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include "device/archetypes.hpp"

#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace trephine;
using namespace std::chrono_literals;
using test::Moment;
using test::ScriptedDevice;
using test::ScriptedScene;

constexpr auto kStill = [](int) { return Moment{}; };

template <class Device, class Scene>
auto simulated(Device& device, Scene& scene, ServoOptions options = {}) {
  return ServoLoop<Device, Scene, NoPacing>(device, scene, Registration{}, options);
}

/// Ends a period at the given read of a device.
template <DeviceStatus kRead, DeviceStatus kWrite>
auto failing_at(int which) {
  return [which](int n) {
    Moment moment;
    if (n == which) {
      moment.read = kRead;
      moment.write = kWrite;
    }
    return moment;
  };
}

TEST_CASE("two hands: the first ticks before the second in each period, both as loops of their own would") {
  ScriptedDevice right(kStill), left(kStill);
  ScriptedScene drill, tube;
  auto first = simulated(right, drill);
  auto second = simulated(left, tube, {.ramp = 0.05});
  std::vector<int> order;
  order.reserve(1000);
  std::vector<double> forces;
  forces.reserve(1000);
  const TwoReports reports = TwoHands{first, second}.run_for(
      250ms, [&](const TickRecord&) { order.push_back(1); },
      [&](const TickRecord& tick) {
        order.push_back(2);
        forces.push_back(tick.sent.force.norm());
      });
  REQUIRE(order.size() == 500);
  for (std::size_t i = 0; i < order.size(); ++i) CHECK(order[i] == 1 + static_cast<int>(i % 2));
  CHECK(reports.first.ticks == 250);
  CHECK(reports.second.ticks == 250);
  CHECK(reports.first.end == RunEnd::kFinished);
  CHECK(reports.second.end == RunEnd::kFinished);
  CHECK(reports.first.reason == "the condition is true");
  CHECK(right.last() == Wrenchd::zero());
  CHECK(left.last() == Wrenchd::zero());
  CHECK(reports.first.zeroed);
  CHECK(reports.second.zeroed);
  // Each rises over its own ramp.
  ScriptedDevice alone_device(kStill);
  ScriptedScene alone_scene;
  auto alone = simulated(alone_device, alone_scene, {.ramp = 0.05});
  std::vector<double> alone_forces;
  alone_forces.reserve(1000);
  (void)alone.run_for(250ms, [&](const TickRecord& tick) { alone_forces.push_back(tick.sent.force.norm()); });
  CHECK(forces == alone_forces);
  CHECK(forces.front() == 0);
  CHECK(forces.back() > 3);
}

TEST_CASE("two hands: what ends one ends both in that period, with zero") {
  constexpr DeviceStatus kOk = DeviceStatus::kOk, kFault = DeviceStatus::kFault;
  const auto runs = [](auto&& right_script, auto&& left_script) {
    ScriptedDevice right(right_script), left(left_script);
    ScriptedScene drill, tube;
    auto first = simulated(right, drill, {.ramp = 0});
    auto second = simulated(left, tube, {.ramp = 0});
    const TwoReports reports = TwoHands{first, second}.run_for(1s);
    CHECK(right.last() == Wrenchd::zero());
    CHECK(left.last() == Wrenchd::zero());
    return std::pair{reports, std::pair{right.writes, left.writes}};
  };
  SUBCASE("the first fails to read") {
    const auto [reports, writes] = runs(failing_at<kFault, kOk>(40), kStill);
    CHECK(reports.first.end == RunEnd::kFault);
    CHECK(reports.second.end == RunEnd::kFinished);
    CHECK(writes.second == 41);  // 40 ticks and the zero
  }
  SUBCASE("the first fails to write") {
    const auto [reports, writes] = runs(failing_at<kOk, kFault>(40), kStill);
    CHECK(reports.first.end == RunEnd::kFault);
    CHECK(writes.second <= 42);
  }
  SUBCASE("the second fails to read") {
    const auto [reports, writes] = runs(kStill, failing_at<kFault, kOk>(40));
    CHECK(reports.second.end == RunEnd::kFault);
    CHECK(reports.first.reason == "the second hand ended");
    CHECK(writes.first == 42);  // 41 ticks and the zero
  }
  SUBCASE("the second fails to write") {
    const auto [reports, writes] = runs(kStill, failing_at<kOk, kFault>(40));
    CHECK(reports.second.end == RunEnd::kFault);
    CHECK(writes.first == 42);
  }
}

TEST_CASE("two hands: a stop of either loop and exceptions of either observer end both with zero") {
  ScriptedDevice right(kStill), left(kStill);
  ScriptedScene drill, tube;
  auto first = simulated(right, drill, {.ramp = 0});
  auto second = simulated(left, tube, {.ramp = 0});
  TwoHands both{first, second};
  const auto stop_second = [&](const TickRecord& tick) {
    if (tick.index == 10) second.stop();
  };
  TwoReports reports = both.run_for(1s, stop_second);
  CHECK(reports.second.end == RunEnd::kStopped);
  CHECK(reports.second.ticks == 10);
  CHECK(reports.first.ticks == 11);
  reports = both.run_for(1s, [&](const TickRecord& tick) {
    if (tick.index == 10) first.stop();
  });
  CHECK(reports.first.end == RunEnd::kStopped);
  CHECK(reports.second.ticks == 11);
  const auto throws = [](const TickRecord& tick) {
    if (tick.index == 10) throw std::runtime_error("observer");
  };
  const auto quiet = [](const TickRecord&) {};
  CHECK_THROWS_WITH_AS((void)both.run_for(1s, throws, quiet), "observer", std::runtime_error);
  CHECK(right.last() == Wrenchd::zero());
  CHECK(left.last() == Wrenchd::zero());
  CHECK_THROWS_WITH_AS((void)both.run_for(1s, quiet, throws), "observer", std::runtime_error);
  CHECK(right.last() == Wrenchd::zero());
  CHECK(left.last() == Wrenchd::zero());
  CHECK(both.run_for(20ms).second.ticks == 20);  // and run again
  CHECK(both.run_for(0ms).second.ticks == 0);
  CHECK_THROWS_AS((void)both.run_for(-1ms), std::invalid_argument);
}

TEST_CASE("two hands: on one bone, each finds what the other cut") {
  VoxelGrid<std::int16_t> bone({.size = {40, 30, 24}, .spacing = {0.5e-3, 0.5e-3, 0.5e-3}}, [] {
    std::vector<std::int16_t> voxels(40 * 30 * 12, 1200);
    voxels.resize(40 * 30 * 24, -1000);
    return voxels;
  }());
  const Burr burr{.tip_radius = 1.5e-3};
  const auto upright = [](double x, double z) { return make_pose<double>(Mat3d::Identity(), Vec3d(x, 7e-3, z)); };
  const auto drills = [&] { return HapticScene{bone, 300, CoupledToolRenderer{burr, CoupledOptions{}}, Cutting{}}; };
  auto right_scene = drills(), left_scene = drills();
  // Two drills come towards each other along x, 1 mm deep, and meet in the middle.
  const auto from = [&](double x, double speed) {
    return [=](double t) { return HandTarget(upright(x + speed * t, 6.3e-3), 1); };
  };
  SimulatedDeviceOptions right_arm, left_arm;
  right_arm.X_DH = upright(3e-3, 6.3e-3);
  left_arm.X_DH = upright(17e-3, 6.3e-3);
  SimulatedDevice right(right_arm, from(3e-3, 4e-3)), left(left_arm, from(17e-3, -4e-3));
  auto first = simulated(right, right_scene);
  auto second = simulated(left, left_scene);
  double right_mm3 = 0, left_mm3 = 0;
  (void)TwoHands{first, second}.run_for(
      3s, [&](const TickRecord& t) { right_mm3 += t.result.removed_mm3; },
      [&](const TickRecord& t) { left_mm3 += t.result.removed_mm3; });
  CHECK(right_mm3 > 5);
  CHECK(left_mm3 > 5);
  // Bone is taken once: together they took what is missing.
  double missing = 0;
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 40; ++i) missing += k < 12 && bone.at(i, j, k) < 300 ? 0.125 : 0.0;
  CHECK(std::abs(right_mm3 + left_mm3 - missing) < 0.35 * missing);  // whole voxels against shares of them
  // In the groove that both made neither is held.
  CHECK(right_scene.tick({.X_WT = upright(10e-3, 6.6e-3)}, 1e-3).wrench.force.norm() < 1);
}

}  // namespace
