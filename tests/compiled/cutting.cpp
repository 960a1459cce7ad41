// SPDX-License-Identifier: MIT
// The law of cutting in compiled scenes, against header scenes that list it.
#include <trephine/compiled/scene.hpp>

#include "integration/scenes.hpp"
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

compiled::Bone bone_like(const VoxelGrid<std::int16_t>& block) {
  const auto& n = block.size();
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  block.copy_voxels(voxels);
  return compiled::Bone({.size = n, .spacing = block.spacing(), .X_WG = block.X_WG()}, voxels);
}

TickInput input_at(int tick, double dt) {
  TickInput input{.X_WT = drilling_pose(dt * tick), .spindle_on = dt * tick > 0.1};
  if (tick % 100 == 50) input.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
  return input;
}

CuttingForceOptions law_of(const CuttingEdges& edges) {
  return {.edges = edges,
          .speed = 1000,
          .clockwise = false,
          .stall_torque = 0.2,
          .strength = {.soft = 10, .cortical = 900},
          .force_scale = 0.1};
}

compiled::StageOptions stages_with(const std::optional<CuttingForceOptions>& law, const AnyCut& cut) {
  return {.cut = cut, .law = law, .limits = {.force = kForceLimit, .torque = kTorqueLimit}};
}

/// How often two scenes differ over a second, in any bit of their results, poses or bone.
template <class HeaderScene>
int differences(HeaderScene& header, compiled::Scene& scene, double dt = 1e-3, int from = 0, int to = 0) {
  int different = 0;
  double torque = 0, removed = 0;
  const int ticks = to > 0 ? to : static_cast<int>(1 / dt);
  for (int tick = from; tick < ticks; ++tick) {
    const TickResult expected = header.tick(input_at(tick, dt), dt), got = scene.tick(input_at(tick, dt), dt);
    different +=
        same_bits(expected, got) && header.cutting_pose_W().matrix() == scene.cutting_pose_W().matrix() ? 0 : 1;
    torque = std::max(torque, got.cutting.torque);
    removed += got.removed_mm3;
  }
  std::vector<std::int16_t> expected(static_cast<std::size_t>(kBlockSize * kBlockSize * kBlockSize)),
      left(expected.size());
  header.bone().copy_voxels(expected);
  scene.bone().copy_voxels(std::span(left));
  CHECK(removed > 1);
  if (scene.stages().law) CHECK(torque > 1e-4);
  return different + (expected == left ? 0 : 1);
}

}  // namespace

TEST_CASE("a compiled scene with the law of cutting equals the header scene with it, bit for bit") {
  const NamedTool tool = tool_by_name("cylinder-3");
  for (const double dt : {1e-3, 0.25e-3}) {
    CAPTURE(dt);
    auto block = make_block<std::int16_t>();
    compiled::Scene scene(bone_like(block), kIsovalue, tool.tool, {}, stages_with(law_of(tool.edges), PressureCut{}));
    HapticScene header{block, kIsovalue, CoupledToolRenderer{tool.tool},
                       Cutting{PressureCut{}, CuttingForce(law_of(tool.edges))},
                       DeviceLimits{kForceLimit, kTorqueLimit}};
    CHECK(differences(header, scene, dt) == 0);
  }
  const CuttingEdges diamond{.kind = CuttingEdges::Kind::kDiamond, .flutes = 0};
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {.friction = Coulomb{0.3, 0.2}},
                        stages_with(law_of(diamond), PressureCut{}));
  HapticScene header{block, kIsovalue, CoupledToolRenderer{kDrill, CoupledOptions{}, Coulomb{0.3, 0.2}},
                     Cutting{PressureCut{}, CuttingForce(law_of(diamond))}, DeviceLimits{kForceLimit, kTorqueLimit}};
  CHECK(differences(header, scene) == 0);
}

TEST_CASE("the law works beside other cuts and renderers as in header scenes") {
  auto block = make_block<std::int16_t>();
  compiled::StageOptions stages = stages_with(law_of({}), RateLimitedCut<>{.rate = 2e4});
  stages.hunt_crossley = HuntCrossley::Options{};
  stages.filter = FirstOrderFilter::Options{};
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill,
                        {.renderer = compiled::RendererKind::kSurface, .surface_counts = SurfaceCounts::thesis()},
                        stages);
  HapticScene header{block,
                     kIsovalue,
                     SurfaceApproxRenderer{ToolDiscretization{kDrill, SurfaceCounts::thesis()}},
                     Cutting{RateLimitedCut<>{.rate = 2e4}, CuttingForce(law_of({}))},
                     HuntCrossley(HuntCrossley::Options{}),
                     FirstOrderFilter(FirstOrderFilter::Options{}),
                     DeviceLimits{kForceLimit, kTorqueLimit}};
  CHECK(differences(header, scene) == 0);
}

TEST_CASE("a geometric cut goes ahead by a speed in compiled scenes too, at any rate of ticks") {
  for (const double dt : {0.25e-3, 1e-3, 2e-3}) {
    CAPTURE(dt);
    auto block = make_block<std::int16_t>();
    compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {}, stages_with({}, GeometricCut{}));
    HapticScene header{block, kIsovalue, CoupledToolRenderer{kDrill}, Cutting{},
                       DeviceLimits{kForceLimit, kTorqueLimit}};
    CHECK(differences(header, scene, dt) == 0);
  }
}

TEST_CASE("the law comes and goes between ticks, follows the tool, and takes nothing from the heap") {
  const NamedTool first = tool_by_name("match-head-3"), second = tool_by_name("diamond-4");
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, first.tool, {}, stages_with({}, GeometricCut{}));
  HapticScene header{block, kIsovalue, CoupledToolRenderer{first.tool},
                     Cutting{PressureCut{}, CuttingForce(law_of(first.edges))},
                     DeviceLimits{kForceLimit, kTorqueLimit}};
  // In the air, without the law: a tick has none of it.
  for (int tick = 0; tick < 100; ++tick) {
    const TickResult expected = header.tick(input_at(tick, 1e-3), 1e-3), got = scene.tick(input_at(tick, 1e-3), 1e-3);
    REQUIRE(expected.wrench == got.wrench);
    REQUIRE(same_bits(got.cutting, CuttingSummary{}));
  }
  // The law comes, and then another tool with its own edges.
  scene.set_stages(stages_with(law_of(first.edges), PressureCut{}));
  CHECK(differences(header, scene, 1e-3, 100, 500) == 0);
  header.renderer().set_tool(second.tool);
  header.cutting().law().adopt(law_of(second.edges));
  scene.set_tool(second.tool);
  scene.set_stages(stages_with(law_of(second.edges), PressureCut{}));
  CHECK(differences(header, scene, 1e-3, 500, 700) == 0);
  // It goes: cuts are geometric, and nothing of it is left when it comes back.
  scene.set_stages(stages_with({}, GeometricCut{}));
  const TickResult without = scene.tick(input_at(701, 1e-3), 1e-3);
  CHECK(same_bits(without.cutting, CuttingSummary{}));

  const auto with = stages_with(law_of(second.edges), PressureCut{}), none = stages_with({}, GeometricCut{});
  double torque = 0;
  const auto calls = heap_calls([&] {
    for (int tick = 0; tick < 700; ++tick) {
      if (tick % 97 == 0) scene.set_stages(tick % 2 == 0 ? with : none);
      if (tick == 300) scene.set_tool(first.tool);
      TickInput input = input_at(tick, 1e-3);
      input.X_WT.translation().y() += 4e-3;
      torque = std::max(torque, scene.tick(input, 1e-3).cutting.torque);
    }
  });
  if (AllocationGuard::available()) CHECK(calls == 0);
  CHECK(torque > 1e-4);
}

TEST_CASE("a law that is out of range, or has no place, is refused") {
  const compiled::Bone bone = bone_like(make_block<std::int16_t>());
  const auto refuse_law = [&](const std::string& word, const CuttingForceOptions& law) {
    check_refused(word, [&] { compiled::Scene(bone, kIsovalue, kDrill, {}, stages_with(law, PressureCut{})); });
  };
  refuse_law("speed", {.speed = 0});
  refuse_law("stall_torque", {.stall_torque = -1});
  refuse_law("force_scale", {.force_scale = 1.5});
  refuse_law("cortical", {.strength = {.soft = 100, .cortical = 100}});
  refuse_law("flutes", {.edges = {.flutes = 0}});
  check_refused("needs a law", [&] { compiled::Scene(bone, kIsovalue, kDrill, {}, stages_with({}, PressureCut{})); });
  for (const auto kind : {compiled::RendererKind::kLine, compiled::RendererKind::kSurface})
    check_refused("for the coupled tool", [&] {
      compiled::Scene(bone, kIsovalue, kDrill, {.renderer = kind}, stages_with(law_of({}), PressureCut{}));
    });
  compiled::Scene scene(bone, kIsovalue, kDrill, {}, stages_with(law_of({}), PressureCut{}));
  check_refused("needs a law", [&] { scene.set_stages(stages_with({}, PressureCut{})); });
  CHECK(scene.stages().law.has_value());
}
