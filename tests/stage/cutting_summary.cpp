// SPDX-License-Identifier: MIT
// The forces of cutting in a tick's result: those of the scene's CuttingForce, and nothing without one.
#include "stage/cutting_runs.hpp"
#include "support/near.hpp"

#include <trephine/device/replay.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/cutting_vibration.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::cutting;

static_assert(CuttingReporter<CuttingForce> && CuttingReporter<CuttingVibration<>>);
static_assert(!CuttingReporter<Cutting<>> && !CuttingReporter<Damping> && !StructureReporter<CuttingForce>);

/// A stage that can break the wrench.
struct Breaker {
  bool breaks = false;
  void apply(const TickContext&, Wrenchd& wrench) noexcept {
    if (breaks) wrench.force.x() = std::numeric_limits<double>::infinity();
  }
};

struct Plunging {
  BoneBlock<std::int16_t> block{.h = 5e-4};
  Vec3d top = block.middle() + 0.2 * block.length * Vec3d::UnitZ();
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{top, Vec3d::UnitZ()});
  NamedTool tool = tool_by_name("cylinder-3");
  CuttingForce::Options options{
      .edges = tool.edges, .stall_torque = 0.05, .strength = block.strength(), .force_scale = 0.25};
  decltype(CoupledToolRenderer{tool.tool, CoupledOptions{}}) renderer{tool.tool, CoupledOptions{.stiffness = 2000}};

  [[nodiscard]] TickInput at(int tick) const {
    return {.X_WT = tool_at(top + (1.7e-3 - tick * 2e-6) * Vec3d::UnitZ(), Vec3d::UnitZ()), .spindle_on = true};
  }
  /// Runs into bone and returns the last tick's result.
  template <class Scene>
  [[nodiscard]] TickResult run(Scene& scene, int ticks = 900) const {
    TickResult r;
    for (int i = 0; i < ticks; ++i) {
      r = scene.tick(at(i), 1e-3);
      const CuttingReport& report = scene.cutting().law().report();
      REQUIRE(same_bits(r.cutting, {report.thrust, report.torque, report.spindle, report.feed}));
    }
    return r;
  }
};

TEST_CASE("cutting summary: each tick tells the thrust, torque, speed and feed of the scene's law") {
  Plunging p;
  HapticScene scene{p.bone, p.block.isovalue(), p.renderer, Cutting{PressureCut{}, CuttingForce(p.options)}};
  static_assert(decltype(scene)::kReportsCutting);
  const TickResult in_air = scene.tick(p.at(0), 1e-3);
  CHECK(in_air.cutting.thrust == 0);
  CHECK(in_air.cutting.torque == 0);
  CHECK(in_air.cutting.spindle == p.options.speed);
  const TickResult r = p.run(scene);
  // The device gets a quarter of the thrust along the axis, and of the torque against the teeth.
  CHECK(r.wrench.force.z() == near(p.options.force_scale * r.cutting.thrust, 8.4e-7));
  CHECK(r.wrench.torque.z() == near(p.options.force_scale * r.cutting.torque, 2.2e-8));
  CHECK(r.cutting.torque > 5e-3);
  // On the mean over a voxel the spindle slows in proportion to the torque, and the hole deepens as the feed says.
  constexpr int kTicks = 400;
  double spindle = 0, torque = 0, feed = 0;
  const auto height = [&] { return scene.renderer().proxy_pose().translation().z(); };
  const double before = height();
  for (int i = 0; i < kTicks; ++i) {
    const CuttingSummary now = scene.tick(p.at(900 + i), 1e-3).cutting;
    spindle += now.spindle / kTicks;
    torque += now.torque / kTicks;
    feed += now.feed / kTicks;
  }
  CHECK(spindle / p.options.speed == near(1 - torque / p.options.stall_torque, 0.01));
  CHECK(feed == near((before - height()) / (kTicks * 1e-3), 0.0074));
}

TEST_CASE("cutting summary: nothing without a law, for bad input, and where the wrench overflows") {
  Plunging p;
  HapticScene bare{p.bone, p.block.isovalue(), p.renderer, Cutting{}};
  static_assert(!decltype(bare)::kReportsCutting);
  for (int i = 800; i < 850; ++i) CHECK(same_bits(bare.tick(p.at(i), 1e-3).cutting, CuttingSummary{}));
  CHECK(bare.tick(p.at(850), 1e-3).contact.count > 0);
  p.bone = p.block.image(HalfSpace{p.top, Vec3d::UnitZ()});

  HapticScene scene{p.bone, p.block.isovalue(), p.renderer, Breaker{}, Cutting{PressureCut{}, CuttingForce(p.options)}};
  const double thrust = p.run(scene).cutting.thrust;
  CHECK(thrust > 1);
  TickInput bad = p.at(900);
  bad.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(same_bits(scene.tick(bad, 1e-3).cutting, CuttingSummary{}));
  CHECK(scene.tick(p.at(900), 1e-3).cutting.thrust == near(thrust, 0.0023));
  scene.part<Breaker>().breaks = true;
  const TickResult broken = scene.tick(p.at(901), 1e-3);
  CHECK(broken.status == Status::kNonFinite);
  CHECK(same_bits(broken.cutting, CuttingSummary{}));
}

TEST_CASE("cutting summary: vibration tells the mean, and a scene of forces alone the torque too") {
  Plunging p;
  HapticScene scene{p.bone, p.block.isovalue(), p.renderer, ForceOnly{},
                    Cutting{PressureCut{}, CuttingVibration{CuttingForce(p.options), {.depth = 1}}}};
  const TickResult r = p.run(scene);
  CHECK(r.cutting.torque > 5e-3);
  CHECK(r.wrench.torque == Vec3d::Zero());
}

}  // namespace
