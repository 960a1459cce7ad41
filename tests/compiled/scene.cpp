// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <trephine/compiled/library.hpp>
#include <trephine/compiled/scene.hpp>

#include "integration/scenes.hpp"
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/tool/named_tools.hpp>

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

static_assert(TickableScene<compiled::Scene>);

constexpr double kDt = 1e-3;

/// The block of `make_block`, as a compiled bone.
template <class Density>
compiled::Bone bone_like(const VoxelGrid<Density>& block, const GridOptions& options = {}) {
  const auto& n = block.size();
  std::vector<Density> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  block.copy_voxels(voxels);
  return compiled::Bone({.size = n, .spacing = block.spacing(), .X_WG = block.X_WG()}, voxels, options);
}

/// Every stage but the forces of cutting, which have tests of their own; with `other`, all their options are not the
/// defaults.
compiled::StageOptions every_stage(bool other = false) {
  compiled::StageOptions o{.cut = RateLimitedCut<>{.rate = 2e4},
                           .release_limit = ReleaseLimit::Options{},
                           .hunt_crossley = HuntCrossley::Options{},
                           .vibration = MillingVibration::Options{},
                           .damping = Damping::Options{.linear = 0.5, .angular = 1e-4},
                           .filter = FirstOrderFilter::Options{},
                           .axis_guide = AxisGuideOptions{.point_G = Vec3d(5e-3, 5e-3, 0)},
                           .depth_stop = DepthStopOptions{.point_G = Vec3d(0, 0, 6e-3)},
                           .passivity = PassivityController::Options{},
                           .rate_limit = WrenchRateLimit::Options{},
                           .limits = {.force = kForceLimit, .torque = kTorqueLimit}};
  if (!other) return o;
  o.release_limit = {.stiffness = 901, .rotational_stiffness = 0.4, .release = 33};
  o.hunt_crossley = {.lambda = 0.7, .max_factor = 1.6, .lever = 0.03};
  o.vibration = {.frequency = 90, .per_force = 0.05, .per_removal = 0.01, .amplitude_limit = 0.4};
  o.damping = {.linear = 0.6, .angular = 2e-4, .only_in_contact = true};
  o.filter = {.cutoff = 70};
  o.axis_guide = {.point_G = Vec3d(4e-3, 5e-3, 0), .axis_G = Vec3d(0.1, 0, 1), .capture_radius = 9e-3, .ramp = 0.3};
  o.depth_stop = {.point_G = Vec3d(0, 0, 4e-3), .reach = 1e-3, .force = 1.1, .damping = 0.5};
  o.passivity = {.stiffness = 301, .angular_stiffness = 0.11, .contact_stiffness = 502, .memory = 0.12};
  o.rate_limit = {.force = 130, .torque = 14};
  o.limits = {.force = 1.5, .torque = 0.05};
  return o;
}

/// The header scene with the same stages in the same order.
template <class Density, class R>
auto scene_with_every_stage(VoxelGrid<Density>& bone, R renderer, bool other = false) {
  const compiled::StageOptions o = every_stage(other);
  return HapticScene{bone,
                     kIsovalue,
                     std::move(renderer),
                     Cutting{{.rate = 2e4}},
                     ReleaseLimit(*o.release_limit),
                     HuntCrossley(*o.hunt_crossley),
                     MillingVibration(*o.vibration),
                     Damping(*o.damping),
                     FirstOrderFilter(*o.filter),
                     AxisGuide(*o.axis_guide),
                     DepthStop(*o.depth_stop),
                     PassivityController(*o.passivity),
                     WrenchRateLimit(*o.rate_limit),
                     o.limits};
}

TickInput input_at(int tick) {
  TickInput input{.X_WT = drilling_pose(kDt * tick), .spindle_on = tick > 300};
  if (tick % 100 == 50) input.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
  return input;
}

bool equal(const TickResult& a, const TickResult& b) {
  return a.wrench == b.wrench && a.removed_mm3 == b.removed_mm3 && a.status == b.status &&
         a.contact.count == b.contact.count && a.contact.tip == b.contact.tip && a.contact.shaft == b.contact.shaft &&
         a.contact.depth == b.contact.depth;
}

template <class HeaderScene>
bool equal_contacts(const HeaderScene& header, const compiled::Scene& scene) {
  std::vector<ContactPoint<double>> a(512), b(512);
  const std::size_t count = header.contacts_W(a);
  if (scene.contacts_W(b) != count) return false;
  for (std::size_t i = 0; i < count; ++i)
    if (a[i].position != b[i].position || a[i].normal != b[i].normal || a[i].force != b[i].force) return false;
  return true;
}

/// Drills with both for a second: all that they tell must be equal, bit for bit, and the bone that is left.
template <class Density, class HeaderScene>
void drill_both(HeaderScene& header, compiled::Scene& scene) {
  double removed = 0, most_force = 0;
  int different = 0;
  for (int tick = 0; tick < 1000; ++tick) {
    const TickInput input = input_at(tick);
    const TickResult expected = header.tick(input, kDt), got = scene.tick(input, kDt);
    const bool same = equal(expected, got) && equal_contacts(header, scene) &&
                      header.proxy_pose_W().matrix() == scene.proxy_pose_W().matrix() &&
                      header.visual_pose_W().matrix() == scene.visual_pose_W().matrix() &&
                      header.cutting_pose_W().matrix() == scene.cutting_pose_W().matrix();
    different += same ? 0 : 1;
    removed += expected.removed_mm3;
    most_force = std::max(most_force, expected.wrench.force.norm());
  }
  CHECK(different == 0);
  CHECK(removed > 0.1);
  CHECK(most_force > 0.05);
  CHECK(header.stiffness() == scene.stiffness());
  if constexpr (requires { header.tangent_stiffness(2.0); })
    CHECK(header.tangent_stiffness(2.0) == scene.tangent_stiffness(2.0));
  std::vector<Density> expected(static_cast<std::size_t>(kBlockSize * kBlockSize * kBlockSize)), left(expected.size());
  header.bone().copy_voxels(expected);
  scene.bone().copy_voxels(std::span(left));
  CHECK(expected == left);
}

template <class R>
void compare_with_every_stage(const char* name, R renderer, const compiled::RendererOptions& options) {
  CAPTURE(name);
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, options, every_stage());
  auto header = scene_with_every_stage(block, std::move(renderer));
  drill_both<std::int16_t>(header, scene);
}

/// Without stages: those that are absent must change nothing.
template <class Density>
void compare_bare(const char* name) {
  CAPTURE(name);
  auto block = make_block<Density>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {.renderer = compiled::RendererKind::kLine},
                        {.cut = AdvancingCut{.speed = 5e-3}});
  HapticScene header{block, kIsovalue, LineApproxRenderer{ToolDiscretization{kDrill, LineCounts{}}},
                     Cutting{AdvancingCut{.speed = 5e-3}}};
  drill_both<Density>(header, scene);
}

const Coulomb kFriction{0.3, 0.2};

}  // namespace

TEST_CASE("a compiled scene equals the header scene bit for bit: every renderer, every stage but cutting") {
  compare_with_every_stage("coupled", CoupledToolRenderer{kDrill}, {});
  compare_with_every_stage("coupled with friction", CoupledToolRenderer{kDrill, CoupledOptions{}, kFriction},
                           {.friction = kFriction});
  const ToolDiscretization line{kDrill, LineCounts{}};
  compare_with_every_stage("line", LineApproxRenderer{line}, {.renderer = compiled::RendererKind::kLine});
  compare_with_every_stage(
      "line with friction", LineApproxRenderer{line, LineOptions{.stiffness = 600}, TranslateRotate{}, kFriction},
      {.renderer = compiled::RendererKind::kLine, .friction = kFriction, .line = {.stiffness = 600}});
  compare_with_every_stage(
      "surface",
      SurfaceApproxRenderer{ToolDiscretization{kDrill, SurfaceCounts::thesis()}, SurfaceOptions{.stiffness = 600}},
      {.renderer = compiled::RendererKind::kSurface,
       .surface = {.stiffness = 600},
       .surface_counts = SurfaceCounts::thesis()});
}

TEST_CASE("every option reaches its stage, at construction and in a running scene") {
  for (const bool running : {false, true}) {
    CAPTURE(running);
    auto block = make_block<std::int16_t>();
    compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {},
                          running ? compiled::StageOptions{} : every_stage(true));
    if (running) scene.set_stages(every_stage(true));
    auto header = scene_with_every_stage(block, CoupledToolRenderer{kDrill}, true);
    drill_both<std::int16_t>(header, scene);
  }
}

TEST_CASE("every option reaches its renderer and its cut: with others than the defaults bits are still equal") {
  const StiffnessBudget budget{.linear = 350, .angular = 0.02};
  compare_with_every_stage("line",
                           LineApproxRenderer{ToolDiscretization{kDrill, LineCounts{.shaft = 33}},
                                              LineOptions{.stiffness = 700, .shaft_stiffness = 90, .budget = budget}},
                           {.renderer = compiled::RendererKind::kLine,
                            .line = {.stiffness = 700, .shaft_stiffness = 90, .budget = budget},
                            .line_counts = {.shaft = 33}});
  compare_with_every_stage(
      "surface",
      SurfaceApproxRenderer{ToolDiscretization{kDrill, SurfaceCounts{.sphere = 40, .slices = 11, .per_slice = 6}},
                            SurfaceOptions{.stiffness = 700, .budget = budget}},
      {.renderer = compiled::RendererKind::kSurface,
       .surface = {.stiffness = 700, .budget = budget},
       .surface_counts = {.sphere = 40, .slices = 11, .per_slice = 6}});
  const CoupledOptions coupled{.stiffness = 500, .rotational_stiffness = 0.2, .force = 2, .torque = 0.05, .bite = 0.5};
  compare_with_every_stage("coupled", CoupledToolRenderer{kDrill, coupled}, {.coupled = coupled});

  const auto compare_cut = [](const char* name, const auto& cut, const CuttingOptions& cutting) {
    CAPTURE(name);
    auto block = make_block<std::int16_t>();
    compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {.renderer = compiled::RendererKind::kLine},
                          {.cut = cut, .cutting = cutting});
    HapticScene header{block, kIsovalue, LineApproxRenderer{ToolDiscretization{kDrill, LineCounts{}}},
                       Cutting{cut, cutting}};
    drill_both<std::int16_t>(header, scene);
  };
  // Forces below and above the bound of a tenth of a newton.
  compare_cut("rate", RateLimitedCut<>{.rate = 3e4, .reference_force = 0.2, .most_force_factor = 0.5}, {.slope = 25});
  compare_cut("speed", AdvancingCut{.speed = 5e-3, .reference_force = 0.2, .most_force_factor = 0.5},
              {.follow_probe = true});
  compare_cut("at once", GeometricCut{}, {});
}

TEST_CASE("absent stages change no bit, with every kind of density") {
  compare_bare<std::uint8_t>("uint8");
  compare_bare<std::uint16_t>("uint16");
  compare_bare<std::int16_t>("int16");
  compare_bare<float>("float");
}

TEST_CASE("8-bit signed densities: what is drilled is removed, and restored") {
  std::vector<std::int8_t> voxels(40 * 40 * 20, 100);
  voxels.resize(40 * 40 * 40, -100);
  compiled::Bone bone({.size = {40, 40, 40}, .spacing = {kVoxel, kVoxel, kVoxel}}, voxels);
  compiled::Scene scene(bone, 0, kDrill, {}, {.cut = GeometricCut{}});
  double removed = 0;
  for (int tick = 0; tick < 400; ++tick) {
    TickInput input{.X_WT = Posed::Identity(), .spindle_on = true};
    input.X_WT.translation() = Vec3d(20 * kVoxel, 20 * kVoxel, 22 * kVoxel - 1e-5 * tick);
    removed += scene.tick(input, kDt).removed_mm3;
  }
  CHECK(removed > 1);
  std::vector<std::int8_t> now(voxels.size());
  bone.copy_voxels(std::span(now));
  CHECK(now != voxels);

  // Another bone takes on what was drilled, and restores as this one.
  std::vector<std::int8_t> original(voxels.size()), there(voxels.size());
  bone.copy_original(std::span(original));
  CHECK(original == voxels);
  compiled::Bone other({.size = {40, 40, 40}, .spacing = {kVoxel, kVoxel, kVoxel}}, original);
  compiled::BoneReader reader(other);
  reader.poll([](std::size_t) {});
  other.lower_to(std::span(now));
  CHECK(reader.poll([](std::size_t) {}) > 0);
  other.copy_voxels(std::span(there));
  CHECK(there == now);
  other.lower_to(std::span(original));  // never adds
  other.copy_voxels(std::span(there));
  CHECK(there == now);
  CHECK(other.restore() == 0);
  other.copy_voxels(std::span(there));
  CHECK(there == voxels);
  std::vector<std::int16_t> wide(voxels.size());
  check_refused("lower_to needs the bone's own density", [&] { other.lower_to(std::span(wide)); });
  check_refused("copy_original needs 64000 voxels", [&] { other.copy_original(std::span(there).first(9)); });

  CHECK(scene.bone().restore() == 0);  // the scene's bone is the same bone
  bone.copy_voxels(std::span(now));
  CHECK(now == voxels);
}

TEST_CASE("a tick and a change of stages take nothing from the heap, with every renderer") {
  using compiled::RendererKind;
  if (!AllocationGuard::available()) MESSAGE("the allocator cannot be watched here: results alone are checked");
  for (const auto kind : {RendererKind::kCoupled, RendererKind::kLine, RendererKind::kSurface})
    for (const bool rough : {false, true}) {
      if (rough && kind == RendererKind::kSurface) continue;
      CAPTURE(static_cast<int>(kind));
      compiled::RendererOptions options{.renderer = kind};
      if (rough) options.friction = kFriction;
      compiled::Scene scene(bone_like(make_block<std::int16_t>()), kIsovalue, kDrill, options, every_stage());
      const compiled::StageOptions with = every_stage(), without{};
      double removed = 0;
      const auto calls = heap_calls([&] {
        for (int tick = 0; tick < 1000; ++tick) {
          if (tick % 97 == 0) scene.set_stages(tick % 2 == 0 ? with : without);
          removed += scene.tick(input_at(tick), kDt).removed_mm3;
        }
      });
      if (AllocationGuard::available()) CHECK(calls == 0);
      CHECK(removed > 0.05);
    }
}

TEST_CASE("stages change between ticks as a header scene's options do") {
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill,
                        {.renderer = compiled::RendererKind::kSurface, .surface_counts = SurfaceCounts::thesis()},
                        every_stage());
  auto header =
      scene_with_every_stage(block, SurfaceApproxRenderer{ToolDiscretization{kDrill, SurfaceCounts::thesis()}});
  int different = 0;
  for (int tick = 0; tick < 1000; ++tick) {
    if (tick == 400) {
      compiled::StageOptions other = scene.stages();
      other.cut = RateLimitedCut<>{.rate = 5e4};
      other.damping->linear = 2;
      other.filter->cutoff = 80;
      other.rate_limit->force = 30;
      other.limits.force = 0.2;
      scene.set_stages(other);
      header.part<Cutting<RateLimitedCut<>>>().adopt({.rate = 5e4});
      header.part<Damping>().adopt({.linear = 2, .angular = 1e-4});
      header.part<FirstOrderFilter>().adopt({.cutoff = 80});
      header.part<WrenchRateLimit>().adopt({.force = 30});
      header.part<DeviceLimits>().adopt({.force = 0.2, .torque = kTorqueLimit});
    }
    different += equal(header.tick(input_at(tick), kDt), scene.tick(input_at(tick), kDt)) ? 0 : 1;
  }
  CHECK(different == 0);

  // Stages that are refused leave those that were there, all of them.
  compiled::StageOptions bad = scene.stages();
  bad.damping->linear = 9;
  bad.limits.force = -1;
  check_refused("DeviceLimits", [&] { scene.set_stages(bad); });
  CHECK(scene.stages().damping->linear == 2);
  CHECK(equal(header.tick(input_at(700), kDt), scene.tick(input_at(700), kDt)));

  // Without stages nothing is cut and nothing limited.
  scene.set_stages({});
  scene.reset();
  CHECK(scene.tick(input_at(701), kDt).removed_mm3 == 0);
}

TEST_CASE("a tool of another shape equals the header scene with it, and changes between ticks likewise") {
  for (const bool rough : {false, true}) {
    CAPTURE(rough);
    const RevolvedTool first = tool_by_name("match-head-3").tool;
    auto block = make_block<std::int16_t>();
    compiled::RendererOptions options;
    if (rough) options.friction = kFriction;
    compiled::Scene scene(bone_like(block), kIsovalue, first, options, every_stage());
    const auto compare = [&](auto header) {
      drill_both<std::int16_t>(header, scene);
      const RevolvedTool pear = tool_by_name("pear-2.3").tool;
      header.renderer().set_tool(pear);
      scene.set_tool(pear);
      // Elsewhere in the block, where there is still bone.
      int different = 0;
      double removed = 0;
      for (int tick = 0; tick < 1000; ++tick) {
        TickInput input = input_at(tick);
        input.X_WT.translation().y() += 5e-3;
        const TickResult expected = header.tick(input, kDt), got = scene.tick(input, kDt);
        different += equal(expected, got) && equal_contacts(header, scene) ? 0 : 1;
        removed += got.removed_mm3;
      }
      CHECK(different == 0);
      CHECK(removed > 0.1);
    };
    if (rough)
      compare(scene_with_every_stage(block, CoupledToolRenderer{first, CoupledOptions{}, kFriction}));
    else
      compare(scene_with_every_stage(block, CoupledToolRenderer{first}));
  }
}

TEST_CASE("a burr changes between ticks, and no change of a tool takes from the heap") {
  const Burr large{.tip_radius = 2e-3, .shaft_radius = 1e-3};
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {}, every_stage());
  auto header = scene_with_every_stage(block, CoupledToolRenderer{kDrill});
  compiled::Scene shaped(bone_like(block), kIsovalue, tool_by_name("disc-6").tool, {}, every_stage());
  const RevolvedTool other = tool_by_name("barrel-4").tool;
  int different = 0;
  const auto calls = heap_calls([&] {
    for (int tick = 300; tick < 600; ++tick) {
      if (tick == 400) {
        scene.set_tool(large);
        header.renderer().set_tool(large);
        shaped.set_tool(other);
      }
      different += equal(header.tick(input_at(tick), kDt), scene.tick(input_at(tick), kDt)) ? 0 : 1;
      static_cast<void>(shaped.tick(input_at(tick), kDt));
    }
  });
  CHECK(different == 0);
  if (AllocationGuard::available()) CHECK(calls == 0);

  check_refused("tip_radius", [&] { scene.set_tool(Burr{.tip_radius = -1}); });
  check_refused("diagonal", [&] { scene.set_tool(Burr{.tip_radius = 0.03, .shaft_length = 0.04}); });
  CHECK(equal(header.tick(input_at(610), kDt), scene.tick(input_at(610), kDt)));
  compiled::Scene line(bone_like(block), kIsovalue, kDrill, {.renderer = compiled::RendererKind::kLine});
  check_refused("coupled tool", [&] { line.set_tool(large); });
  check_refused("coupled tool", [&] { line.set_tool(other); });
  for (const auto kind : {compiled::RendererKind::kLine, compiled::RendererKind::kSurface})
    check_refused("take a Burr, got " + std::string(kind == compiled::RendererKind::kLine ? "line" : "surface"),
                  [&] { compiled::Scene(bone_like(block), kIsovalue, MatchHead{}, {.renderer = kind}); });
}

TEST_CASE("a burr becomes a revolved tool, and that a burr, in a running scene, which then is as one made with it") {
  const RevolvedTool disc = tool_by_name("disc-6").tool;
  const auto become = [&](const auto& first, const auto& second) {
    auto block = make_block<std::int16_t>();
    compiled::Scene changing(bone_like(block), kIsovalue, first, {}, every_stage());
    compiled::Scene made(bone_like(block), kIsovalue, second, {}, every_stage());
    TickInput in_air{.X_WT = drilling_pose(0)};
    in_air.X_WT.translation().z() += 0.02;
    for (int tick = 0; tick < 50; ++tick) static_cast<void>(changing.tick(in_air, kDt));
    const auto calls = heap_calls([&] { changing.set_tool(second); });
    if (AllocationGuard::available()) CHECK(calls == 0);
    static_cast<void>(made.tick(in_air, kDt));
    static_cast<void>(changing.tick(in_air, kDt));
    int different = 0;
    double removed = 0;
    for (int tick = 0; tick < 700; ++tick) {
      const TickResult a = made.tick(input_at(tick), kDt), b = changing.tick(input_at(tick), kDt);
      different += equal(a, b) && made.cutting_pose_W().matrix() == changing.cutting_pose_W().matrix() ? 0 : 1;
      removed += b.removed_mm3;
    }
    CHECK(different == 0);
    CHECK(removed > 0.1);
  };
  become(kDrill, disc);
  become(disc, kDrill);
}

TEST_CASE("wrong arguments are refused at construction") {
  auto block = make_block<std::int16_t>();
  const compiled::Bone bone = bone_like(block);
  const auto refuse_scene = [&](const std::string& word, const compiled::RendererOptions& renderer,
                                const compiled::StageOptions& stages = {}, double isovalue = kIsovalue,
                                const Burr& burr = kDrill) {
    check_refused(word, [&] { compiled::Scene(bone, isovalue, burr, renderer, stages); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuse_scene("isovalue", {}, {}, nan);
  refuse_scene("tip_radius", {}, {}, kIsovalue, Burr{.tip_radius = -1});
  refuse_scene("diagonal", {}, {}, kIsovalue, Burr{.tip_radius = 0.03, .shaft_length = 0.04});
  refuse_scene("Surface has no friction", {.renderer = compiled::RendererKind::kSurface, .friction = kFriction});
  refuse_scene("renderer", {.renderer = static_cast<compiled::RendererKind>(9)});
  refuse_scene("CoupledOptions", {.coupled = {.stiffness = nan}});
  refuse_scene("LineOptions", {.renderer = compiled::RendererKind::kLine, .line = {.stiffness = 0}});
  refuse_scene("shaft vertices", {.renderer = compiled::RendererKind::kLine, .line_counts = {.shaft = 0}});
  refuse_scene("SurfaceOptions", {.renderer = compiled::RendererKind::kSurface, .surface = {.stiffness = -1}});
  refuse_scene("StiffnessBudget", {.renderer = compiled::RendererKind::kSurface,
                                   .surface = {.budget = StiffnessBudget{.linear = 0, .angular = 1}}});
  refuse_scene("RateLimitedCut", {}, {.cut = RateLimitedCut<>{.rate = 0}});
  refuse_scene("AdvancingCut", {}, {.cut = AdvancingCut{.speed = nan}});
  refuse_scene("slope", {}, {.cut = GeometricCut{}, .cutting = {.slope = -1}});
  refuse_scene("converted<", {}, {.cut = GeometricCut{}, .cutting = {.slope = 2}});
  refuse_scene("HuntCrossley", {}, {.hunt_crossley = HuntCrossley::Options{.max_factor = 0}});
  refuse_scene("MillingVibration", {}, {.vibration = MillingVibration::Options{.frequency = 1000}});
  refuse_scene("Damping", {}, {.damping = Damping::Options{.linear = -1}});
  refuse_scene("FirstOrderFilter", {}, {.filter = FirstOrderFilter::Options{.cutoff = 0}});
  refuse_scene("PassivityController", {}, {.passivity = PassivityController::Options{.memory = 0}});
  refuse_scene("ReleaseLimit", {}, {.release_limit = ReleaseLimit::Options{.release = 0}});
  refuse_scene("WrenchRateLimit", {}, {.rate_limit = WrenchRateLimit::Options{.force = 0}});
  refuse_scene("DeviceLimits", {}, {.limits = {.force = nan}});

  const std::vector<float> voxels(7);
  check_refused("VoxelGrid", [&] { compiled::Bone({.size = {2, 2, 2}, .spacing = {1e-3, 1e-3, 1e-3}}, voxels); });
  std::vector<float> other(static_cast<std::size_t>(kBlockSize * kBlockSize * kBlockSize));
  check_refused("own density", [&] { bone.copy_voxels(std::span(other)); });
  const compiled::BoneReader reader(bone);
  std::vector<std::int16_t> brick(1000);
  check_refused("no such brick", [&] { reader.copy_brick(1000000, std::span(brick)); });
  check_refused("no such brick", [&] { static_cast<void>(reader.brick_range(1000000)); });
  check_refused("1000 voxels", [&] { reader.copy_brick(0, std::span(brick).first(999)); });
  check_refused("own density", [&] { reader.copy_brick(0, std::span(other).first(1000)); });
  Posed skewed = Posed::Identity();
  skewed.linear() *= 2;
  compiled::Bone moved = bone;
  check_refused("VoxelGrid", [&] { moved.set_X_WG(skewed); });
}

TEST_CASE("a reader names the bricks that a scene changed and copies them as GridReader does") {
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {}, {.cut = GeometricCut{}});
  HapticScene header{block, kIsovalue, CoupledToolRenderer{kDrill}, Cutting{}};
  GridReader<std::int16_t> expected(block);
  compiled::BoneReader reader(scene.bone());
  CHECK(reader.poll([](std::size_t) {}) == block.brick_count());
  CHECK(expected.poll([](std::size_t) {}) == block.brick_count());
  for (int tick = 300; tick < 600; ++tick) {
    CHECK(equal(header.tick(input_at(tick), kDt), scene.tick(input_at(tick), kDt)));
  }
  std::vector<std::size_t> named, named_by_header;
  reader.poll([&](std::size_t brick) { named.push_back(brick); });
  expected.poll([&](std::size_t brick) { named_by_header.push_back(brick); });
  CHECK(!named.empty());
  CHECK(named == named_by_header);
  std::vector<std::int16_t> ours(1000), theirs(1000);
  for (const std::size_t brick : named) {
    reader.copy_brick(brick, std::span(ours));
    const auto range = expected.copy_brick(brick, std::span<std::int16_t, 1000>(theirs));
    CHECK(ours == theirs);
    CHECK(reader.brick_range(brick) == std::array<double, 2>{double(range.min), double(range.max)});
  }
  CHECK(reader.poll([](std::size_t) {}) == 0);
}

TEST_CASE("a bone moves with its scene, and lives as long as one of them") {
  Posed X_WG = Posed::Identity();
  X_WG.translation() = Vec3d(0.1, -0.2, 0.3);
  auto block = make_block<std::uint8_t>();
  std::unique_ptr<compiled::BoneReader> reader;
  const auto make = [&] {
    compiled::Bone bone = bone_like(block);
    reader = std::make_unique<compiled::BoneReader>(bone);
    bone.set_X_WG(X_WG);
    return compiled::Scene(bone, kIsovalue, kDrill);
  };
  compiled::Scene scene = make();
  CHECK(scene.bone().X_WG().matrix() == X_WG.matrix());
  CHECK(scene.bone().bricks() == block.bricks());
  TickInput input{.X_WT = Posed(X_WG * drilling_pose(0.399))};
  static_cast<void>(scene.tick({.X_WT = Posed(X_WG * drilling_pose(0))}, kDt));
  for (int tick = 1; tick < 400; ++tick) {
    input.X_WT = X_WG * drilling_pose(kDt * tick);
    static_cast<void>(scene.tick(input, kDt));
  }
  CHECK(scene.tick(input, kDt).wrench.force.z() > 0.5);
  CHECK(reader->poll([](std::size_t) {}) == block.brick_count());
}
