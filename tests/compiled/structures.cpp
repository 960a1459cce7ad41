// SPDX-License-Identifier: MIT
// Structures of a compiled scene, against the header scene that lists the same parts.
#include <trephine/compiled/library.hpp>
#include <trephine/compiled/structures.hpp>

#include "integration/scenes.hpp"
#include "structure/phantom.hpp"
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <trephine/core/units.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kDt = 1e-3;
constexpr double kReach = 6e-3;

constexpr int kDeep = 600;  // a tick at which the drill is at its deepest

/// Where the drill is deepest: a nerve below it that is protected, and a tube beside it that may break.
const LabelledTubes& tubes() {
  static const LabelledTubes made = [] {
    const Vec3d tip = drilling_pose(kDt * kDeep).translation();
    const auto at = [&](double x, double y, double z) { return Vec3d(tip + Vec3d(x * 1_mm, y * 1_mm, z * 1_mm)); };
    LabelledTubes t{.tubes = {{at(-5, 0, -1.5), at(5, 0, -1.5), 0.6_mm}, {at(1, -3, 0), at(1, 3, 0), 0.7_mm}},
                    .structure = {0, 1}};
    return t;
  }();
  return made;
}

/// The labels' frame: the tubes are given in the bone's.
struct Labelled {
  compiled::LabelGeometry geometry;
  std::vector<std::uint8_t> labels;
  std::shared_ptr<const StructureField> field;
};

const Labelled& labelled() {
  static const Labelled made = [] {
    LabelledTubes local = tubes();
    const Vec3d corner = drilling_pose(kDt * kDeep).translation() - Vec3d::Constant(0.5 * 48 * 0.3e-3);
    for (Tube& tube : local.tubes) {
      tube.from -= corner;
      tube.to -= corner;
    }
    local.size = {48, 48, 48};
    Labelled l;
    l.labels = local.labels();
    l.geometry = {.size = local.size,
                  .spacing = Vec3d::Constant(local.voxel),
                  .X_GS = make_pose<double>(Mat3d::Identity(), corner),
                  .field = {.reach = kReach}};
    l.field = local.field(kReach);
    return l;
  }();
  return made;
}

std::vector<ProtectedStructure> each() {
  return {
      {.guard = {.margin = 0.8_mm, .stiffness = 700, .greatest_force = 0.3, .damping = 3}, .veto = {.margin = 0.2_mm}},
      {.guard = {.mode = GuardMode::kWarn, .margin = 1_mm}, .veto = {.mode = StructureVeto::Mode::kWatch}}};
}

compiled::StageOptions stages() {
  return {.cut = RateLimitedCut<>{.rate = 2e5}, .limits = {.force = kForceLimit, .torque = kTorqueLimit}};
}

template <class Density>
compiled::Bone bone_like(const VoxelGrid<Density>& block) {
  const auto& n = block.size();
  std::vector<Density> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  block.copy_voxels(voxels);
  return compiled::Bone({.size = n, .spacing = block.spacing(), .X_WG = block.X_WG()}, voxels);
}

TickInput input_at(int tick) {
  TickInput input{.X_WT = drilling_pose(kDt * tick), .spindle_on = tick > 300};
  if (tick % 100 == 50) input.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
  return input;
}

/// `cutting` is that of `options`.
template <class Tool, class Cut>
void compare_guarded(const Tool& tool, const compiled::StageOptions& options, const Cut& cutting) {
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, tool, {}, options);
  const compiled::Structures structures(labelled().geometry, labelled().labels);
  CHECK(structures.count() == 2);
  // Numbers that no default has: each option must arrive.
  const StiffnessBudget budget{.linear = 2000, .angular = 0.05};
  scene.set_structures(structures, each(),
                       {.potential = {.smoothing = 0.5e-3, .budget = budget}, .guard = {.ramp_time = 0.1}});

  const Posed X_GS = labelled().geometry.X_GS;
  const std::vector<GuardedStructure> guards{{.margin = 0.8_mm, .stiffness = 700, .greatest_force = 0.3, .damping = 3},
                                             {.mode = GuardMode::kWarn, .margin = 1_mm}};
  const std::vector<StructureVeto> vetoes{{.margin = 0.2_mm}, {.mode = StructureVeto::Mode::kWatch}};
  const auto floor = make_cut_floor(*labelled().field, X_GS, block, kIsovalue, vetoes);
  HapticScene header{block,
                     kIsovalue,
                     CoupledToolRenderer{tool},
                     cutting,
                     Veto{floor},
                     StructureGuard{std::make_shared<const GuardPotential>(
                                        labelled().field, X_GS, tool, guards,
                                        GuardPotentialOptions{.smoothing = 0.5e-3, .budget = budget}),
                                    {.ramp_time = 0.1}},
                     DeviceLimits{kForceLimit, kTorqueLimit}};
  int different = 0, pushed = 0, warned = 0;
  double refused = 0, taken = 0;
  for (int tick = 0; tick < 1500; ++tick) {
    if (tick == 1300) {  // the push goes off, then on again
      scene.set_push(false);
      header.template part<StructureGuard>().adopt({.push = false, .ramp_time = 0.1});
    }
    if (tick == 1400) {
      scene.set_push(true);
      header.template part<StructureGuard>().adopt({.ramp_time = 0.1});
    }
    const TickInput input = input_at(std::min(tick, kDeep));
    const TickResult expected = header.tick(input, kDt), got = scene.tick(input, kDt);
    different += same_bits(expected, got) ? 0 : 1;
    pushed += got.structures.push.force.norm() > 0.05 ? 1 : 0;
    warned += got.structures.warns ? 1 : 0;
    refused += got.structures.refused_mm3;
    taken += got.structures.taken_mm3;
  }
  CHECK(different == 0);
  CHECK(pushed > 100);
  CHECK(warned > 100);
  CHECK(refused > 0);
  CHECK(taken > 0);
  CHECK(refused == near(floor->refused_mm3()));
  CHECK(taken == near(floor->taken_mm3()));
  std::vector<std::int16_t> expected(static_cast<std::size_t>(kBlockSize * kBlockSize * kBlockSize)),
      left(expected.size());
  block.copy_voxels(expected);
  scene.bone().copy_voxels(std::span(left));
  CHECK(expected == left);

  check_refused("a guarded scene", [&] { scene.set_tool(tool); });
  scene.clear_structures();
  CHECK_NOTHROW(scene.set_tool(tool));
}

}  // namespace

TEST_CASE("soft structures: a compiled scene feels and tears them as the header scene does, bit for bit") {
  Membrane weak = nerve();
  weak.strength = 0.8e6;
  const std::vector<std::optional<Membrane>> membranes{weak, std::nullopt};
  const SoftOptions options{.smoothing = 0.5e-3, .force_scale = 0.5};
  const std::vector<ProtectedStructure> free(
      2, {.guard = {.mode = GuardMode::kWarn}, .veto = {.mode = StructureVeto::Mode::kFree}});
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {}, stages());
  const compiled::Structures structures(labelled().geometry, labelled().labels);
  const compiled::Structures soft = structures.soft(membranes, options);
  CHECK(soft.count() == 2);
  scene.set_structures(soft, free);
  const Posed X_GS = labelled().geometry.X_GS;
  const std::vector<GuardedStructure> guards(2, free[0].guard);
  HapticScene header{block,
                     kIsovalue,
                     CoupledToolRenderer{kDrill},
                     Cutting{RateLimitedCut<>{.rate = 2e5}},
                     StructureGuard{std::make_shared<const GuardPotential>(labelled().field, X_GS, kDrill, guards)},
                     SoftStructures{labelled().field, X_GS, kDrill, membranes, options},
                     DeviceLimits{kForceLimit, kTorqueLimit}};
  int different = 0, tears = 0;
  double most = 0;
  std::optional<compiled::Scene> copy;
  const auto same = [](const TickResult& a, const TickResult& b) {
    return same_bits(a, b) && same_bits(a.structures.soft_force, b.structures.soft_force) &&
           a.structures.tears == b.structures.tears;
  };
  std::int64_t heap = 0;
  for (int tick = 0; tick < 1500; ++tick) {
    TickInput input = input_at(tick < 1200 ? std::min(tick, kDeep) : 0);
    if (tick > kDeep && tick < 1200) input.X_WT.translation().z() -= 5e-6 * (tick - kDeep);
    if (tick == 700) copy = scene.copy();
    if (tick == 1250) {
      scene.heal();
      copy->heal();
      header.part<SoftStructures>().heal();
    }
    if (tick == 1300) scene.take(*copy);
    const TickResult expected = header.tick(input, kDt);
    TickResult got;
    const std::int64_t calls = heap_calls([&] { got = scene.tick(input, kDt); });
    if (tick != 1300) heap += calls;
    different += same(expected, got) ? 0 : 1;
    if (copy) different += same(expected, copy->tick(input, kDt)) ? 0 : 1;
    tears += got.structures.tears ? 1 : 0;
    most = std::max(most, got.structures.soft_force);
  }
  CHECK(different == 0);
  CHECK(heap == 0);
  CHECK(tears > 10);
  CHECK(most == near(weak.law(kDrill.tip_radius).rupture_force, 0.05));

  compiled::Scene line(bone_like(block), kIsovalue, kDrill, {.renderer = compiled::RendererKind::kLine}, stages());
  check_refused("coupled tool", [&] { line.set_structures(soft, free); });
  CHECK_NOTHROW(line.set_structures(structures, free));
  check_refused("one entry", [&] { static_cast<void>(structures.soft(std::vector<std::optional<Membrane>>(3))); });
  check_refused("force_scale", [&] { static_cast<void>(structures.soft(membranes, {.force_scale = 2})); });
  check_refused("thickness", [&] {
    static_cast<void>(structures.soft(std::vector<std::optional<Membrane>>{Membrane{.thickness = 0}, std::nullopt}));
  });
}

TEST_CASE("a compiled scene guards structures and spares them as the header scene does, bit for bit") {
  const Cutting cutting{{.rate = 2e5}};
  compare_guarded(kDrill, stages(), cutting);
  compare_guarded(tool_by_name("match-head-3").tool, stages(), cutting);
}

TEST_CASE("a cut by the law of cutting spares structures as in the header scene, bit for bit") {
  const NamedTool tool = tool_by_name("match-head-3");
  compiled::StageOptions options = stages();
  options.cut = PressureCut{};
  options.law = CuttingForceOptions{.edges = tool.edges, .strength = {.cortical = 900}, .force_scale = 0.1};
  compare_guarded(tool.tool, options, Cutting{PressureCut{}, CuttingForce(*options.law)});
}

TEST_CASE("a planned cavity keeps cuts within it") {
  compiled::Scene scene(bone_like(make_block<std::int16_t>()), kIsovalue, kDrill, {}, stages());
  std::vector<ProtectedStructure> cavity = each();
  for (ProtectedStructure& s : cavity)
    s = {.guard = {.mode = GuardMode::kOff}, .veto = {.mode = StructureVeto::Mode::kFree}};
  cavity[1].veto = {.mode = StructureVeto::Mode::kKeepIn, .margin = 0.3_mm};
  scene.set_structures(compiled::Structures(labelled().geometry, labelled().labels), cavity);
  double refused = 0;
  for (int tick = 0; tick < kDeep; ++tick) refused += scene.tick(input_at(tick), kDt).structures.refused_mm3;
  CHECK(refused > 1);
  std::vector<std::int16_t> left(static_cast<std::size_t>(kBlockSize * kBlockSize * kBlockSize));
  scene.bone().copy_voxels(std::span(left));
  const auto whole = make_block<std::int16_t>();
  const Posed X_SG = labelled().geometry.X_GS.inverse();
  int lost = 0;
  for (std::size_t v = 0; v < left.size(); ++v) {
    const auto n = static_cast<std::size_t>(kBlockSize);
    const Vec3d p_G =
        kVoxel * Vec3d(static_cast<double>(v % n), static_cast<double>(v / n % n), static_cast<double>(v / (n * n)));
    const bool bone =
        whole.at(static_cast<int>(v % n), static_cast<int>(v / n % n), static_cast<int>(v / (n * n))) > kIsovalue;
    lost += bone && left[v] < kIsovalue && labelled().field->distance(1, X_SG * p_G) > -0.3_mm ? 1 : 0;
  }
  CHECK(lost == 0);
}

TEST_CASE("structures come and go between ticks, and other stages leave them") {
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {}, stages());
  compiled::Scene bare(bone_like(block), kIsovalue, kDrill, {}, stages());
  const auto without_structures = [&](int from, int to) {
    int different = 0;
    for (int tick = from; tick < to; ++tick)
      different += same_bits(scene.tick(input_at(tick), kDt), bare.tick(input_at(tick), kDt)) ? 0 : 1;
    return different;
  };
  CHECK(without_structures(0, 200) == 0);
  scene.clear_structures();
  scene.set_push(true);
  CHECK(without_structures(200, 250) == 0);

  {
    const compiled::Structures structures(labelled().geometry, labelled().labels);
    scene.set_structures(structures, each());
  }  // the scene keeps what it uses
  CHECK(scene.tick(input_at(251), kDt).structures.nearest >= 0);
  // A change of milling keeps the veto.
  compiled::StageOptions others = stages();
  others.cut = GeometricCut{};
  scene.set_stages(others);
  double refused = 0;
  for (int tick = 301; tick < kDeep; ++tick) refused += scene.tick(input_at(tick), kDt).structures.refused_mm3;
  CHECK(refused > 0);
  // Without milling nothing is refused; with it again, the floor is still there, and its counts go on.
  others.cut = {};
  scene.set_stages(others);
  CHECK(scene.tick(input_at(kDeep), kDt).structures.refused_mm3 == 0);
  scene.set_stages(stages());
  CHECK(scene.tick(input_at(kDeep), kDt).structures.nearest >= 0);

  scene.clear_structures();
  const TickResult r = scene.tick(input_at(kDeep), kDt);
  CHECK(same_bits(r.structures, StructureSummary{}));
}

TEST_CASE("a tick with structures takes nothing from the heap, nor does the switch of the push or of stages") {
  if (!AllocationGuard::available()) return;
  compiled::Scene scene(bone_like(make_block<std::int16_t>()), kIsovalue, kDrill, {}, stages());
  scene.set_structures(compiled::Structures(labelled().geometry, labelled().labels), each());
  const compiled::StageOptions with = stages(), without{};
  double pushes = 0;
  const auto calls = heap_calls([&] {
    for (int tick = 0; tick < 1000; ++tick) {
      if (tick % 97 == 0) scene.set_push(tick % 2 == 0);
      if (tick % 89 == 0) scene.set_stages(tick % 3 != 0 ? with : without);
      pushes += scene.tick(input_at(tick), kDt).structures.push.force.norm();
    }
  });
  CHECK(calls == 0);
  CHECK(pushes > 0);
}

TEST_CASE("a protection that is exchanged acts as one that is set, and goes on where it was when it comes back") {
  auto block = make_block<std::int16_t>();
  compiled::Scene scene(bone_like(block), kIsovalue, kDrill, {}, stages());
  compiled::Scene set(bone_like(block), kIsovalue, kDrill, {}, stages());
  const compiled::Structures structures(labelled().geometry, labelled().labels);
  const auto differ = [&](int from, int to) {
    int different = 0;
    for (int tick = from; tick < to; ++tick)
      different += same_bits(scene.tick(input_at(tick), kDt), set.tick(input_at(tick), kDt)) ? 0 : 1;
    return different;
  };
  compiled::Protection protection = scene.make_protection(structures, each());
  CHECK(differ(0, 100) == 0);  // made, but not in
  scene.exchange(protection);
  set.set_structures(structures, each());
  CHECK(differ(100, kDeep) == 0);
  const auto at_depth = [&] { return scene.tick(input_at(kDeep), kDt); };
  for (int n = 0; n < 400; ++n) (void)at_depth();
  const double push = at_depth().structures.push.force.norm();
  const compiled::StructureTotals first = scene.totals(0), second = scene.totals(1);
  CHECK(push > 0.2);
  CHECK(first.refused_mm3 > 0);
  CHECK(first.taken_mm3 == 0);
  CHECK(second.taken_mm3 > 0);
  CHECK(second.breaches == 1);
  CHECK(scene.totals(-1).breaches == 0);
  CHECK(scene.totals(2).refused_mm3 == 0);

  scene.exchange(protection);  // out: nothing was in before
  CHECK(same_bits(at_depth().structures, StructureSummary{}));
  CHECK(scene.totals(0).refused_mm3 == 0);
  CHECK(protection.totals(0).refused_mm3 == first.refused_mm3);
  CHECK(protection.totals(1).breaches == second.breaches);
  scene.exchange(protection);
  CHECK(at_depth().structures.push.force.norm() < 0.012 * push);  // fades in anew: a tick of its ramp
  CHECK(scene.totals(0).refused_mm3 >= first.refused_mm3);
  for (int n = 0; n < 400; ++n) (void)at_depth();
  CHECK(at_depth().structures.push.force.norm() > 0.5 * push);

  compiled::Protection other = set.make_protection();
  check_refused("made for this scene", [&] { scene.exchange(other); });
  compiled::Scene bytes(bone_like(make_block<std::uint8_t>()), kIsovalue, kDrill, {}, stages());
  compiled::Protection byte = bytes.make_protection();
  check_refused("made for this scene", [&] { scene.exchange(byte); });
  CHECK(at_depth().structures.push.force.norm() > 0.5 * push);
}

TEST_CASE("protections are made and freed on one thread while another ticks, drills and exchanges without the heap") {
  compiled::Scene scene(bone_like(make_block<std::int16_t>()), kIsovalue, kDrill, {}, stages());
  const compiled::Structures structures(labelled().geometry, labelled().labels);
  std::atomic<compiled::Protection*> next{nullptr}, before{nullptr};
  std::atomic<bool> done{false};
  constexpr int kMade = 8;
  std::thread builder([&] {
    for (int n = 0; n < kMade; ++n) {
      std::vector<ProtectedStructure> others = each();
      others[0].guard.margin = (0.3 + 0.1 * n) * 1e-3;
      others[0].veto.mode = n % 2 == 0 ? StructureVeto::Mode::kProtect : StructureVeto::Mode::kWatch;
      auto made = std::make_unique<compiled::Protection>(n % 4 == 3 ? scene.make_protection()
                                                                    : scene.make_protection(structures, others));
      next.store(made.get(), std::memory_order_release);
      while (before.exchange(nullptr, std::memory_order_acquire) != made.get()) std::this_thread::yield();
    }
    done = true;
  });
  std::int64_t calls = 0;
  int exchanged = 0, guarded = 0, ticks = 0;
  for (; !done; ++ticks) {
    const AllocationGuard heap;
    if (compiled::Protection* const protection = next.exchange(nullptr, std::memory_order_acquire)) {
      scene.exchange(*protection);
      before.store(protection, std::memory_order_release);
      ++exchanged;
    }
    guarded += scene.tick(input_at(ticks % kDeep), kDt).structures.nearest >= 0 ? 1 : 0;
    calls += heap.allocations() + heap.frees();
  }
  builder.join();
  CHECK(calls == 0);
  CHECK(exchanged == kMade);
  CHECK(guarded > 0);
  CHECK(guarded < ticks);
}

TEST_CASE("structures that cannot be are refused, and leave those that were") {
  compiled::Scene scene(bone_like(make_block<std::int16_t>()), kIsovalue, kDrill, {}, stages());
  const compiled::Structures structures(labelled().geometry, labelled().labels);
  scene.set_structures(structures, each());
  for (int tick = 0; tick < 20; ++tick) (void)scene.tick(input_at(kDeep), kDt);
  const TickResult before = scene.tick(input_at(kDeep), 1e-9);
  const auto refuse = [&](const std::string& word, auto&& change) {
    std::vector<ProtectedStructure> bad = each();
    ProtectionOptions options;
    change(bad, options);
    check_refused(word, [&] { scene.set_structures(structures, bad, options); });
  };
  using All = std::vector<ProtectedStructure>;
  using Options = ProtectionOptions;
  refuse("one entry", [](All& s, Options&) { s.pop_back(); });
  refuse("margin", [](All& s, Options&) { s[0].guard.margin = -1; });
  refuse("stiffness", [](All& s, Options&) { s[0].guard.stiffness = 0; });
  refuse("bands", [](All& s, Options&) { s[0].guard.margin = 20e-3; });
  refuse("margin", [](All& s, Options&) { s[1].veto.margin = -1; });
  refuse("bands", [](All& s, Options&) { s[0].veto.margin = 5.9e-3; });
  refuse("GuardMode", [](All& s, Options&) { s[0].guard.mode = static_cast<GuardMode>(7); });
  refuse("StructureVeto", [](All& s, Options&) { s[0].veto.mode = static_cast<StructureVeto::Mode>(7); });
  refuse("ramp_time", [](All&, Options& o) { o.guard.ramp_time = 0; });
  refuse("smoothing", [](All&, Options& o) { o.potential.smoothing = 0; });
  CHECK(scene.tick(input_at(kDeep), 1e-9).structures.nearest == before.structures.nearest);
  CHECK(scene.tick(input_at(kDeep), 1e-9).structures.push.force.norm() > 0);

  compiled::LabelGeometry g = labelled().geometry;
  const auto refuse_labels = [&](const std::string& word) {
    check_refused(word, [&] { compiled::Structures(g, labelled().labels); });
    g = labelled().geometry;
  };
  g.spacing.y() = 0;
  refuse_labels("spacing");
  g.size[0] = 47;
  refuse_labels("one number a voxel");
  g.field.reach = 0;
  refuse_labels("reach");
  g.X_GS.linear() *= 2;
  refuse_labels("X_GS");
}
