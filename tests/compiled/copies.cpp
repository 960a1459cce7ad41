// SPDX-License-Identifier: MIT
// Scenes that go on from another's state: a copy, and a scene that takes a copy's state back.
#include <trephine/compiled/library.hpp>
#include <trephine/compiled/structures.hpp>

#include "integration/scenes.hpp"
#include "structure/phantom.hpp"
#include "support/check_refused.hpp"

#include <trephine/core/units.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kDt = 1e-3;
constexpr int kTicks = 1000;

template <class Density>
std::vector<Density> voxels_of(const compiled::Bone& bone) {
  const auto& n = bone.size();
  std::vector<Density> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  bone.copy_voxels(std::span(voxels));
  return voxels;
}

template <class Density>
compiled::Bone bone_of(const GridOptions& options = {}) {
  const auto block = make_block<Density>();
  const auto& n = block.size();
  std::vector<Density> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  block.copy_voxels(voxels);
  return compiled::Bone({.size = n, .spacing = block.spacing(), .X_WG = block.X_WG()}, voxels, options);
}

/// Drilling, a pose now and then that is none, and a jump.
TickInput input_at(int tick) {
  TickInput input{.X_WT = drilling_pose(kDt * tick), .spindle_on = tick > 150};
  if (tick % 100 == 50) input.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
  if (tick == 730) input.X_WT.translation().z() += 6_mm;
  return input;
}

struct Outcome {
  TickResult result;
  std::vector<ContactPoint<double>> contacts;
  Posed proxy, visual, cutting;
};

Outcome tick_of(compiled::Scene& scene, int tick) {
  Outcome o{scene.tick(input_at(tick), kDt), {}, scene.proxy_pose_W(), scene.visual_pose_W(), scene.cutting_pose_W()};
  o.contacts.resize(4096);
  o.contacts.resize(scene.contacts_W(o.contacts));
  return o;
}

bool equal(const Outcome& a, const Outcome& b) {
  if (!same_bits(a.result, b.result) || a.contacts.size() != b.contacts.size()) return false;
  for (std::size_t i = 0; i < a.contacts.size(); ++i)
    if (a.contacts[i].position != b.contacts[i].position || a.contacts[i].force != b.contacts[i].force) return false;
  return a.proxy.matrix() == b.proxy.matrix() && a.visual.matrix() == b.visual.matrix() &&
         a.cutting.matrix() == b.cutting.matrix();
}

/// Runs a scene and, from every `each`th tick, a copy of it, and the scene itself back from a copy.
template <class Density>
void check_goes_on(compiled::Scene scene, int each = 37, int length = 50) {
  int different = 0, cut = 0, touched = 0;
  for (int start = 0; start < kTicks; start += each) {
    const compiled::Scene saved = scene.copy();
    CHECK(voxels_of<Density>(saved.bone()) == voxels_of<Density>(scene.bone()));
    compiled::Scene copy = saved.copy();
    std::vector<Outcome> first;
    for (int tick = start; tick < start + length; ++tick) first.push_back(tick_of(scene, tick));
    for (int tick = start; tick < start + length; ++tick) {
      const Outcome again = tick_of(copy, tick);
      different += equal(again, first[static_cast<std::size_t>(tick - start)]) ? 0 : 1;
      cut += again.result.removed_mm3 > 0 ? 1 : 0;
      touched += again.result.contact.count > 0 ? 1 : 0;
    }
    CHECK(voxels_of<Density>(copy.bone()) == voxels_of<Density>(scene.bone()));
    for (int s = 0; s < 3; ++s) CHECK(copy.totals(s).refused_mm3 == scene.totals(s).refused_mm3);
    scene.take(saved);
    CHECK(voxels_of<Density>(saved.bone()) == voxels_of<Density>(scene.bone()));
    for (int tick = start; tick < start + length; ++tick)
      different += equal(tick_of(scene, tick), first[static_cast<std::size_t>(tick - start)]) ? 0 : 1;
    CHECK(voxels_of<Density>(copy.bone()) == voxels_of<Density>(scene.bone()));
    scene.take(saved);
    for (int tick = start; tick < start + each; ++tick) (void)tick_of(scene, tick);
  }
  CHECK(different == 0);
  CHECK(cut > 100);
  CHECK(touched > 300);
}

compiled::StageOptions stages(const AnyCut& cut) {
  return {.cut = cut, .limits = {.force = kForceLimit, .torque = kTorqueLimit}};
}

compiled::StageOptions every_stage() {
  compiled::StageOptions o = stages(AdvancingCut{.speed = 4e-3});
  o.release_limit = ReleaseLimit::Options{};
  o.hunt_crossley = HuntCrossley::Options{};
  o.vibration = MillingVibration::Options{};
  o.damping = Damping::Options{.linear = 0.5, .angular = 1e-4};
  o.filter = FirstOrderFilter::Options{};
  o.axis_guide = AxisGuideOptions{.point_G = Vec3d(5e-3, 5e-3, 0)};
  o.depth_stop = DepthStopOptions{.point_G = Vec3d(0, 0, 6e-3)};
  o.passivity = PassivityController::Options{};
  o.rate_limit = WrenchRateLimit::Options{};
  return o;
}

}  // namespace

TEST_CASE("a copy of a scene, and a scene that takes its state back, go on with the same bits") {
  using compiled::RendererKind;
  SUBCASE("coupled tool, friction, cut at once") {
    check_goes_on<std::int16_t>(
        {bone_of<std::int16_t>(), kIsovalue, kDrill, {.friction = Coulomb{0.4, 0.3}}, stages(GeometricCut{})});
  }
  SUBCASE("coupled tool, cut at once in turns") {
    compiled::StageOptions o = stages(GeometricCut{});
    o.cutting.blocks = 20;
    check_goes_on<std::int16_t>({bone_of<std::int16_t>(), kIsovalue, kDrill, {.friction = Coulomb{0.4, 0.3}}, o});
  }
  SUBCASE("coupled tool, floats, every stage") {
    check_goes_on<float>({bone_of<float>(), kIsovalue, kDrill, {}, every_stage()});
  }
  SUBCASE("line") {
    check_goes_on<std::uint8_t>(
        {bone_of<std::uint8_t>(), kIsovalue, kDrill, {.renderer = RendererKind::kLine}, every_stage()});
  }
  SUBCASE("surface, cut at once") {
    check_goes_on<std::int16_t>(
        {bone_of<std::int16_t>(), kIsovalue, kDrill, {.renderer = RendererKind::kSurface}, stages(GeometricCut{})});
  }
  SUBCASE("law of cutting") {
    const NamedTool tool = tool_by_name("match-head-3");
    compiled::StageOptions o = stages(PressureCut{});
    o.law = CuttingForceOptions{.edges = tool.edges, .strength = {.cortical = 900}, .force_scale = 0.1};
    check_goes_on<std::int16_t>({bone_of<std::int16_t>(), kIsovalue, tool.tool, {}, o});
  }
}

TEST_CASE("a copy keeps guard, floors and counts, each scene its own") {
  const Vec3d tip = drilling_pose(kDt * 600).translation();
  LabelledTubes tubes{.tubes = {{tip + Vec3d(-5_mm, 0, -1.5_mm), tip + Vec3d(5_mm, 0, -1.5_mm), 0.6_mm},
                                {tip + Vec3d(1_mm, -3_mm, 0), tip + Vec3d(1_mm, 3_mm, 0), 0.7_mm}},
                      .structure = {0, 1}};
  const Vec3d corner = tip - Vec3d::Constant(0.5 * 48 * 0.3e-3);
  for (Tube& tube : tubes.tubes) {
    tube.from -= corner;
    tube.to -= corner;
  }
  tubes.size = {48, 48, 48};
  const compiled::Structures structures({.size = tubes.size,
                                         .spacing = Vec3d::Constant(tubes.voxel),
                                         .X_GS = make_pose<double>(Mat3d::Identity(), corner),
                                         .field = {.reach = 6_mm}},
                                        tubes.labels());
  const std::vector<ProtectedStructure> each{
      {.guard = {.margin = 0.8_mm, .stiffness = 700, .greatest_force = 0.3, .damping = 3}, .veto = {.margin = 0.2_mm}},
      {.guard = {.mode = GuardMode::kWarn, .margin = 1_mm}, .veto = {.mode = StructureVeto::Mode::kWatch}}};
  for (const AnyCut& cut : {AnyCut(GeometricCut{}), AnyCut(RateLimitedCut<>{.rate = 2e5})}) {
    compiled::Scene scene(bone_of<std::int16_t>(), kIsovalue, kDrill, {}, stages(cut));
    scene.set_structures(structures, each);
    check_goes_on<std::int16_t>(std::move(scene));
  }
  // A protection that came or went since: the scene gets that of the copy, and the copy's counts stay its own.
  compiled::Scene scene(bone_of<std::int16_t>(), kIsovalue, kDrill, {}, stages(GeometricCut{}));
  const compiled::Scene bare = scene.copy();
  scene.set_structures(structures, each);
  for (int tick = 0; tick < 600; ++tick) (void)scene.tick(input_at(tick), kDt);
  const compiled::Scene guarded = scene.copy();
  const double refused = guarded.totals(0).refused_mm3;
  CHECK(refused > 0);
  scene.take(bare);
  CHECK(scene.totals(0).refused_mm3 == 0);
  for (int tick = 0; tick < 600; ++tick) CHECK(scene.tick(input_at(tick), kDt).structures.nearest == -1);
  scene.take(guarded);
  CHECK(scene.totals(0).refused_mm3 == refused);
  for (int tick = 600; tick < 700; ++tick) (void)scene.tick(input_at(tick), kDt);
  CHECK(guarded.totals(0).refused_mm3 == refused);
}

TEST_CASE("a state is refused that is another bone's, another scene's, or cannot be put back") {
  compiled::Scene scene(bone_of<std::int16_t>(), kIsovalue, kDrill);
  const compiled::Scene other(bone_of<std::int16_t>(), kIsovalue, kDrill);
  check_refused("another grid", [&] { scene.take(other); });
  const compiled::Scene bytes(bone_of<std::uint8_t>(), kIsovalue, kDrill);
  check_refused("another density type", [&] { scene.take(bytes); });
  compiled::Scene no_original(bone_of<std::int16_t>({.keep_original = false}), kIsovalue, kDrill);
  const compiled::Scene copy = no_original.copy();
  check_refused("keep_original", [&] { no_original.take(copy); });
  const compiled::Scene line(scene.bone(), kIsovalue, kDrill, {.renderer = compiled::RendererKind::kLine});
  check_refused("another scene", [&] { scene.take(line); });
}
