// SPDX-License-Identifier: MIT
// Another tool in a running scene: from then on it is a new scene with that tool.
#include "integration/scenes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/revolved_tools.hpp"

#include <doctest/doctest.h>

#include <trephine/stage/cutting.hpp>
#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr double kDt = 1e-3;

template <class Shape, class Law>
using RendererOf = CoupledToolRenderer<Shape, Law>;

/// The same block, cut as far.
VoxelGrid<std::uint8_t> copy_of(const VoxelGrid<std::uint8_t>& bone) {
  auto copy = make_block<std::uint8_t>();
  for (int k = 0; k < kBlockSize; ++k)
    for (int j = 0; j < kBlockSize; ++j)
      (void)copy.lower_row(j, k, 0, kBlockSize - 1, [&](int i, std::uint8_t) { return bone.at(i, j, k); });
  copy.commit();
  return copy;
}

bool equal(const TickResult& a, const TickResult& b) {
  return a.wrench == b.wrench && a.removed_mm3 == b.removed_mm3 && a.status == b.status &&
         a.contact.count == b.contact.count && a.contact.tip == b.contact.tip && a.contact.shaft == b.contact.shaft &&
         a.contact.depth == b.contact.depth;
}

struct Told {
  int different = 0;  ///< ticks that differ from the new scene's
  double force = 0;   ///< largest after the change [N]
  double removed = 0;
  int kept = 0;    ///< ticks in contact while a new scene's tool is in bone
  int ramped = 0;  ///< changes after which the status asks for a ramp
};

/// Without a bound on the wrench's change, which goes on from the last tool's wrench; so do filters and rate limits.
const CoupledOptions kUnbounded{.release = std::numeric_limits<double>::infinity()};
template <class R>
auto make_scene_without_bounds(VoxelGrid<std::uint8_t>& bone, R renderer) {
  return HapticScene{bone,
                     kIsovalue,
                     std::move(renderer),
                     Cutting{{.rate = 2e4}},
                     Damping({.linear = 0.5, .angular = 1e-4}),
                     HuntCrossley(HuntCrossley::Options{}),
                     MillingVibration(MillingVibration::Options{}),
                     AxisGuide({.point_G = {kBlockMiddle, kBlockMiddle, 0}, .force = kGuideForce, .torque = 1e-3}),
                     DeviceLimits{kForceLimit, kTorqueLimit}};
}

/// Drills with each tool for a while, and then goes on with the next one beside a new scene with that tool.
template <class Shape, class Law>
Told change_through(const std::vector<Shape>& tools, const Law& law) {
  Told told;
  auto bone = make_block<std::uint8_t>();
  auto scene = make_scene_without_bounds(bone, RendererOf<Shape, Law>(tools.front(), kUnbounded, law));
  int tick = 250;
  const auto input = [&] { return TickInput{.X_WT = drilling_pose(kDt * tick), .spindle_on = tick % 100 > 20}; };
  for (; tick < 350; ++tick) (void)scene.tick(input(), kDt);
  for (std::size_t t = 1; t < tools.size(); ++t) {
    auto twin_bone = copy_of(bone);
    auto twin = make_scene_without_bounds(twin_bone, RendererOf<Shape, Law>(tools[t], kUnbounded, law));
    scene.renderer().set_tool(tools[t]);
    bool twin_is_in_bone = false;
    for (int i = 0; i < 60; ++i, ++tick) {
      const TickResult expected = twin.tick(input(), kDt), got = scene.tick(input(), kDt);
      if (i == 0) twin_is_in_bone = expected.status == Status::kStartedInside && expected.contact.count == 0;
      told.force = std::max(told.force, got.wrench.force.norm());
      told.removed += got.removed_mm3;
      if (i == 0) {
        if (got.contact.count > 0) CHECK(needs_ramp(got.status));
        told.ramped += needs_ramp(got.status) ? 1 : 0;
      }
      // With its axis in bone the new scene has no force, while this one goes on from where its tool was free.
      if (twin_is_in_bone) {
        told.kept += got.contact.count > 0 ? 1 : 0;
        continue;
      }
      told.different += equal(expected, got) && twin.visual_pose_W().matrix() == scene.visual_pose_W().matrix() &&
                                twin.cutting_pose_W().matrix() == scene.cutting_pose_W().matrix()
                            ? 0
                            : 1;
    }
    std::vector<std::uint8_t> left(std::size_t{kBlockSize} * kBlockSize * kBlockSize), expected(left.size());
    scene.bone().copy_voxels(left);
    twin.bone().copy_voxels(expected);
    if (!twin_is_in_bone) CHECK(left == expected);
  }
  return told;
}

std::vector<RevolvedTool> shapes() {
  std::vector<RevolvedTool> tools;
  for (const ToolOfShape& t : revolved_tools()) tools.push_back(t.tool);
  return tools;
}

/// Burrs from three voxels to one, whose elements need more and fewer points.
const std::vector<BallAndShaft> kBurrs{Burr{.tip_radius = 1.5e-3}, Burr{.tip_radius = 0.6e-3, .shaft_radius = 0.4e-3},
                                       Burr{.tip_radius = 3e-3}, Burr{.tip_radius = 1e-3}, Burr{.tip_radius = 2e-3}};

}  // namespace

TEST_CASE("tool change: the scene goes on as a new scene with that tool, bit for bit") {
  for (const bool rough : {false, true}) {
    CAPTURE(rough);
    const Coulomb law = rough ? Coulomb(0.3, 0.2) : Coulomb(0, 0);
    for (const Told& told : {change_through(shapes(), law), change_through(kBurrs, law)}) {
      CHECK(told.different == 0);
      CHECK(told.force > 0.5);
      CHECK(told.removed > 0.5);
      CHECK(told.ramped > 1);
    }
  }
  CHECK(change_through(shapes(), Frictionless{}).different == 0);
}

TEST_CASE("tool change: neither the change nor a tick with it takes from the heap") {
  if (!AllocationGuard::available()) return;
  auto bone = make_block<std::uint8_t>();
  const std::vector<RevolvedTool> tools = shapes();
  const auto run = [&](auto& scene, const auto& others) {
    double force = 0;
    const auto calls = heap_calls([&] {
      for (int tick = 250; tick < 800; ++tick) {
        if (tick % 25 == 0) scene.renderer().set_tool(others[static_cast<std::size_t>(tick / 25) % others.size()]);
        const TickResult r = scene.tick({.X_WT = drilling_pose(kDt * tick), .spindle_on = tick % 100 < 25}, kDt);
        force = std::max(force, r.wrench.force.norm());
      }
    });
    CHECK(calls == 0);
    CHECK(force > 0.5);
  };
  auto scene = make_full_scene(bone, RendererOf<RevolvedTool, Coulomb>(tools.front()));
  run(scene, tools);
  auto of_burr = make_full_scene(bone, RendererOf<BallAndShaft, Coulomb>(kBurrs.front()));
  run(of_burr, kBurrs);
}

TEST_CASE("tool change: into bone there is no force at once that is not to be ramped") {
  auto bone = make_block<std::uint8_t>();
  auto scene = HapticScene{bone, kIsovalue, CoupledToolRenderer{tool_by_name("round-1.5").tool}, Cutting{}};
  // Free in a hole that it cut itself.
  TickInput input{.X_WT = Posed::Identity(), .spindle_on = true};
  for (int tick = 0; tick < 600; ++tick) {
    input.X_WT.translation() = Vec3d(kBlockMiddle, kBlockMiddle, kSurfaceHeight + 1e-3 - 5e-6 * tick);
    (void)scene.tick(input, kDt);
  }
  for (int tick = 0; tick < 100; ++tick) (void)scene.tick(input, kDt);
  input.spindle_on = false;
  REQUIRE(scene.tick(input, kDt).wrench.force.norm() < 0.055);
  // Wider than the hole: its rim, or its axis, is in bone.
  for (const char* name : {"match-head-4", "cylinder-4", "disc-10"}) {
    CAPTURE(name);
    scene.renderer().set_tool(tool_by_name(name).tool);
    const TickResult r = scene.tick(input, kDt);
    CHECK(needs_ramp(r.status));
    CHECK(r.status == Status::kStartedInside);
    CHECK(r.removed_mm3 == 0);
  }
  // The head cuts at once where it is, whatever was cut last there.
  scene.renderer().set_tool(tool_by_name("match-head-3").tool);
  input.spindle_on = true;
  CHECK(scene.tick(input, kDt).removed_mm3 > 1);
  scene.renderer().set_tool(tool_by_name("cylinder-3").tool);
  CHECK(scene.tick(input, kDt).removed_mm3 > 0.5);
}

TEST_CASE("tool change: another thread's post is taken at the next tick, whatever its input") {
  auto bone = make_block<std::uint8_t>();
  Mailbox<std::optional<RevolvedTool>> tools;
  auto scene = HapticScene{bone, kIsovalue, Remote{CoupledToolRenderer{MatchHead{}}, tools}, Cutting{}, DeviceLimits{}};
  const TickInput input{.X_WT = drilling_pose(0.35), .spindle_on = true};
  (void)scene.tick({.X_WT = drilling_pose(0.34)}, kDt);
  CHECK(scene.renderer().tool().bounds().radius == near(1.5e-3));
  tools.post(DiscBurr{.radius = 3e-3, .thickness = 1.5e-3});
  TickInput bad = input;
  bad.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(scene.tick(bad, kDt).status == Status::kBadInput);
  CHECK(scene.renderer().tool().bounds().radius == near(3e-3));
  auto twin_bone = copy_of(bone);
  auto twin = HapticScene{twin_bone, kIsovalue, CoupledToolRenderer{DiscBurr{.radius = 3e-3, .thickness = 1.5e-3}},
                          Cutting{}, DeviceLimits{}};
  for (int i = 0; i < 10; ++i) CHECK(equal(scene.tick(input, kDt), twin.tick(input, kDt)));
  // Nothing changes nothing.
  tools.post(std::nullopt);
  CHECK(equal(scene.tick(input, kDt), twin.tick(input, kDt)));
}
