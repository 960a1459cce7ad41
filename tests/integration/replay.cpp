// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "integration/scenes.hpp"

#include <chrono>
#include <string>
#include <utility>

using namespace trephine;
using namespace trephine::test;

namespace {

SimulatedDeviceOptions device_options() {
  SimulatedDeviceOptions options;
  options.X_DH = drilling_pose(0);
  options.hand_linear.stiffness = 800;
  return options;
}

HandTarget hand(double t) { return {drilling_pose(t), t > 0.1 ? 1U : 0U}; }

/// Drills for a second in closed loop, records, puts the bone back and replays.
template <class R>
void record_and_replay(R renderer, const std::string& name) {
  CAPTURE(name);
  auto bone = make_block<std::int16_t>();
  auto scene = make_full_scene(bone, std::move(renderer));
  SimulatedDevice device(device_options(), hand);
  ServoLoop loop(device, scene, Registration{}, {}, NoPacing{});
  Recorder recorder(1000);
  const RunReport report = loop.run_for(std::chrono::seconds(1), recorder);
  REQUIRE(report.end == RunEnd::kFinished);
  REQUIRE(recorder.size() == 1000);

  double removed = 0;
  int touching = 0;
  for (const RecordedTick& tick : recorder.ticks()) {
    removed += tick.result.removed_mm3;
    touching += tick.result.contact.count > 0 ? 1 : 0;
    CHECK(tick.result.wrench.force.norm() <= kForceLimit);
    CHECK(tick.result.wrench.torque.norm() <= kTorqueLimit);
  }
  CHECK(removed > 1.0);
  CHECK(touching > 150);

  REQUIRE(bone.restore() == 0);
  scene.reset();
  const ReplayReport again = replay(recorder.ticks(), scene);
  CHECK(again.ticks == 1000);
  CHECK(again.identical());

  // Not restored, the bone is another one: the replay notices.
  scene.reset();
  CHECK_FALSE(replay(recorder.ticks(), scene).identical());
}

}  // namespace

TEST_CASE("a recorded session replays bit for bit on the restored bone") {
  record_and_replay(make_line<float>(), "line");
  record_and_replay(make_thesis_line<double>(), "thesis line");
  record_and_replay(make_surface<float>(), "surface");
  record_and_replay(make_thesis_surface<double>(), "thesis surface");
  record_and_replay(make_coupled(), "coupled");
}
