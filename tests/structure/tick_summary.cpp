// SPDX-License-Identifier: MIT
// A tick's summary of structures, against the parts that it comes from.
#include "stage/fakes.hpp"
#include "structure/phantom.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/session/recorder.hpp>
#include <trephine/session/recording_file.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/structure/protection.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>
#include <trephine/voxel/tissue_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kIso = 300;
constexpr int kSize = 48;
constexpr double kVoxel = 0.35e-3;
const Burr kBurr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 12_mm};
using Bone = VoxelGrid<std::int16_t>;
using Mode = StructureVeto::Mode;

const std::shared_ptr<const StructureField>& field() {
  static const std::shared_ptr<const StructureField> made = canals().field(5_mm);
  return made;
}

/// Bone all over, in a pose that is none of the axes'.
Bone solid() {
  const std::vector<std::int16_t> voxels(static_cast<std::size_t>(kSize) * kSize * kSize, 1200);
  return {{.size = {kSize, kSize, kSize},
           .spacing = Vec3d::Constant(kVoxel),
           .X_WG = make_pose<double>(rotation_from_vector<double>(Vec3d(0.5, 0.2, -0.3)), Vec3d(0.02, -0.01, 0.03)),
           .outside = -1000},
          voxels};
}

Posed X_GS() { return make_pose<double>(rotation_from_vector<double>(Vec3d(0.1, -0.15, 0.2)), Vec3d(0.5_mm, 0, 0)); }

std::shared_ptr<const GuardPotential> potential() {
  const std::vector<GuardedStructure> guards{
      {.margin = 1_mm}, {.mode = GuardMode::kWarn, .margin = 1.5_mm}, {.margin = 0.5_mm, .stiffness = 600}};
  return std::make_shared<const GuardPotential>(field(), X_GS(), kBurr, guards);
}

/// The first is protected, the second may break, the third is protected.
std::shared_ptr<CutFloor<std::int16_t>> floor_of(const Bone& bone) {
  const std::array<StructureVeto, 3> vetoes{StructureVeto{.margin = 0.4_mm}, StructureVeto{.mode = Mode::kWatch},
                                            StructureVeto{}};
  return make_cut_floor(*field(), X_GS(), bone, kIso, vetoes);
}

/// Poses in W that wander through the bone at some cm/s, with jumps and bad ones.
class Wanderer {
 public:
  explicit Wanderer(const Bone& bone, unsigned seed) : X_WG_(bone.X_WG()), random_(seed) { leap(); }

  TickInput next() {
    if (random_.below(60) == 0) v_ = random_.arrow(0, 0.08);
    if (random_.below(500) == 0 || (X_GT_.translation() - middle()).norm() > 0.7 * kSize * kVoxel) leap();
    X_GT_.translation() += 1e-3 * v_;
    TickInput input{.X_WT = X_WG_ * X_GT_, .spindle_on = random_.below(20) != 0};
    if (random_.below(150) == 0) input.X_WT.translation().y() = kNaN;
    return input;
  }

 private:
  static Vec3d middle() { return Vec3d::Constant(0.5 * kSize * kVoxel); }
  void leap() {
    X_GT_ = make_pose<double>(random_.rotation(), Vec3d(middle() + random_.arrow(0, 0.4) * kSize * kVoxel));
  }

  Posed X_WG_;
  Random random_;
  Posed X_GT_ = Posed::Identity();
  Vec3d v_ = Vec3d::Zero();
};

bool is_default(const StructureSummary& s) {
  return s.nearest == -1 && s.distance == kInf && s.push == Wrenchd::zero() && s.refused_mm3 == 0 && s.taken_mm3 == 0 &&
         !s.warns;
}

auto renderer() { return LineApproxRenderer{ToolDiscretization{kBurr, LineCounts{}}}; }

}  // namespace

TEST_CASE("a tick's nearest structure, distance and push are the guard's, its volumes add up to the floor's") {
  Bone bone = solid();
  const auto floor = floor_of(bone);
  const auto guard = potential();
  HapticScene scene{
      bone, kIso, renderer(), Cutting{{.rate = 1e6}}, Veto{floor}, StructureGuard{guard}, DeviceLimits{.force = 100}};
  Wanderer wanderer(bone, 3);
  double refused = 0, taken = 0;
  int wrong = 0, bad = 0, pushed = 0, warned = 0, refusals = 0;
  std::vector<GuardPotential::Push> pushes(guard->most_pushes());
  std::vector<AxisProbe> probes(guard->most_probes());
  for (int n = 0; n < 6000; ++n) {
    const TickInput input = wanderer.next();
    const FloorCounts before = floor->counts();
    const StructureSummary s = scene.tick(input, kTick).structures;
    refused += s.refused_mm3;
    taken += s.taken_mm3;
    if (!input.X_WT.matrix().allFinite()) {
      ++bad;
      wrong += is_default(s) ? 0 : 1;
      continue;
    }
    const Posed X_ST = X_GS().inverse() * bone.X_WG().inverse() * input.X_WT;
    const std::size_t count = guard->find(X_ST, pushes, probes).probes;
    const ToolDistance d = tool_distance(*field(), kBurr, X_ST, {probes.data(), count});
    const GuardReport& report = scene.part<StructureGuard>().report();
    const double voxel = std::pow(1e3 * kVoxel, 3);
    wrong += s.nearest == d.structure && std::abs(s.distance - d.distance) < 1e-12 && s.push == report.push &&
                     s.warns == report.warns &&
                     std::abs(s.refused_mm3 - voxel * static_cast<double>(floor->counts().refused - before.refused)) <
                         1e-12 * voxel * 1e6
                 ? 0
                 : 1;
    pushed += s.push.force.norm() > 0.1 ? 1 : 0;
    warned += s.warns ? 1 : 0;
    refusals += s.refused_mm3 > 0 ? 1 : 0;
  }
  CHECK(wrong == 0);
  CHECK(bad > 10);
  CHECK(pushed > 200);
  CHECK(warned > 200);
  CHECK(refusals > 20);
  CHECK(refused == near(floor->refused_mm3(), 1e-14));
  CHECK(taken == near(floor->taken_mm3(), 1e-12));
  CHECK(floor->refused_mm3() > 1);
  CHECK(floor->taken_mm3() > 0.1);
  CHECK(floor->taken_mm3() == floor->taken_mm3(1));
}

TEST_CASE("a tick's wrench without its push is that of the scene whose guard only warns") {
  Bone bone = solid(), twin_bone = solid();
  const auto guard = potential();
  HapticScene scene{bone, kIso, renderer(), Cutting{{.rate = 1e6}}, Veto{floor_of(bone)}, StructureGuard{guard}};
  HapticScene twin{twin_bone,
                   kIso,
                   renderer(),
                   Cutting{{.rate = 1e6}},
                   Veto{floor_of(twin_bone)},
                   StructureGuard{guard, {.push = false}}};
  Wanderer wanderer(bone, 5);
  double off = 0, most = 0, contact = 0;
  int differ = 0;
  for (int n = 0; n < 6000; ++n) {
    const TickInput input = wanderer.next();
    const TickResult r = scene.tick(input, kTick), t = twin.tick(input, kTick);
    off = std::max({off, (r.wrench.force - r.structures.push.force - t.wrench.force).norm(),
                    100 * (r.wrench.torque - r.structures.push.torque - t.wrench.torque).norm()});
    most = std::max(most, r.structures.push.force.norm());
    contact = std::max(contact, t.wrench.force.norm());
    differ += t.structures.push == Wrenchd::zero() && t.structures.nearest == r.structures.nearest &&
                      t.structures.distance == r.structures.distance && t.structures.warns == r.structures.warns &&
                      t.structures.refused_mm3 == r.structures.refused_mm3
                  ? 0
                  : 1;
  }
  CHECK(off < 1e-14);
  CHECK(differ == 0);
  CHECK(most > 0.5);
  CHECK(contact > 0.5);
}

TEST_CASE("a Protection acts as its guard and its veto do, bit for bit, and finds the reach that they need") {
  const std::vector<ProtectedStructure> spared{
      {.guard = {.margin = 1_mm}, .veto = {.margin = 0.4_mm}},
      {.guard = {.mode = GuardMode::kWarn, .margin = 1.5_mm}, .veto = {.mode = Mode::kWatch}},
      {.guard = {.margin = 0.5_mm, .stiffness = 600}}};
  Bone bone = solid(), twin_bone = solid();
  HapticScene parts{bone, kIso, renderer(), Cutting{{.rate = 1e6}}, StructureGuard{potential()}, Veto{floor_of(bone)}};
  HapticScene one{twin_bone, kIso, renderer(), Cutting{{.rate = 1e6}},
                  Protection{field(), X_GS(), twin_bone, kIso, kBurr, spared}};
  Wanderer wanderer(bone, 12);
  int differ = 0;
  double refused = 0, taken = 0, pushed = 0;
  std::int64_t heap = 0;
  for (int n = 0; n < 4000; ++n) {
    if (n == 2000) {
      parts.reset();
      one.reset();
    }
    const TickInput input = wanderer.next();
    const TickResult a = parts.tick(input, kTick);
    TickResult b;
    heap += heap_calls([&] { b = one.tick(input, kTick); });
    differ += same_bits(a.wrench, b.wrench) && same_bits(a.structures, b.structures) ? 0 : 1;
    refused += b.structures.refused_mm3;
    taken += b.structures.taken_mm3;
    pushed = std::max(pushed, b.structures.push.force.norm());
  }
  CHECK(differ == 0);
  CHECK(heap == 0);
  CHECK(refused > 0);
  CHECK(taken > 0);
  CHECK(pushed > 0.5);
  std::vector<std::int16_t> left(static_cast<std::size_t>(kSize) * kSize * kSize), twin_left(left.size());
  bone.copy_voxels(left);
  twin_bone.copy_voxels(twin_left);
  CHECK(left == twin_left);
  const auto& protection = one.part<Protection<std::int16_t>>();
  CHECK(refused == near(protection.cut_floor()->refused_mm3(), 1e-12));

  // The reach is enough, and hardly more.
  const double reach = Protection<std::int16_t>::required_reach(bone, kBurr, spared);
  const auto with_reach = [&](double r) {
    return Protection{std::shared_ptr<const StructureField>(canals().field(r)), X_GS(), bone, kIso, kBurr, spared};
  };
  CHECK_NOTHROW(with_reach(reach));
  CHECK_THROWS_AS(with_reach(0.9 * reach), std::invalid_argument);
  CHECK_THROWS_AS((Protection{field(), X_GS(), bone, kIso, kBurr, std::span(spared).first(2)}), std::invalid_argument);
  Bone other({.size = {8, 8, 8}, .spacing = Vec3d::Constant(kVoxel)}, std::vector<std::int16_t>(512, 1200));
  CHECK_THROWS_AS(protection.validate_for(other, kIso), std::invalid_argument);
}

TEST_CASE("volumes of a tick are its scene's own, where two scenes share a floor or have their own") {
  Bone bone = solid();
  const auto one = floor_of(bone), two = floor_of(bone);
  const auto tissues = std::make_shared<const TissueMap>(bone, std::array{1.5}, [](int, int, int) { return 0; });
  HapticScene first{bone, kIso, renderer(), Cutting{GeometricCut{}, {.follow_probe = true}}, Veto{one}};
  HapticScene second{bone, kIso, renderer(), Cutting{TissueCut{AdvancingCut{.speed = 0.05}, tissues}}, Veto{one}};
  HapticScene third{bone, kIso, renderer(), Cutting{{.rate = 1e6}, {.follow_probe = true}}, Veto{two}};
  Wanderer wanderer(bone, 9);
  double refused = 0, taken = 0;
  int quiet = 0;
  const auto total = [&] { return one->refused_mm3() + two->refused_mm3() + one->taken_mm3() + two->taken_mm3(); };
  for (int n = 0; n < 3000; ++n) {
    TickInput input = wanderer.next();
    const auto judge = [&](auto& scene) {
      const double before = total();
      const StructureSummary s = scene.tick(input, kTick).structures;
      refused += s.refused_mm3;
      taken += s.taken_mm3;
      CHECK(s.refused_mm3 + s.taken_mm3 == near(total() - before, 1e-11));
      if (!input.spindle_on) quiet += s.refused_mm3 == 0 && s.taken_mm3 == 0 ? 0 : 1;
      CHECK((s.nearest == -1 && s.distance == kInf));  // no guard
    };
    judge(first);
    judge(second);
    judge(third);
  }
  CHECK(quiet == 0);
  CHECK(two->refused_mm3() > 0);
  CHECK(one->taken_mm3() > 0);
  CHECK(refused == near(one->refused_mm3() + two->refused_mm3(), 1e-12));
  CHECK(taken == near(one->taken_mm3() + two->taken_mm3(), 1e-12));
}

namespace {

/// A stage that pushes, and can break the wrench.
struct Pusher {
  double distance = 1;
  int number = 0;
  double force = 1;
  void apply(const TickContext&, Wrenchd& wrench) noexcept { wrench += push(); }
  void add_to(StructureSummary& s) const noexcept {
    s.push += push();
    if (distance < s.distance) {
      s.nearest = number;
      s.distance = distance;
    }
  }
  [[nodiscard]] Wrenchd push() const { return {Vec3d(force, 0, 0), Vec3d(0, 1e-3, 0)}; }
};
struct OtherPusher : Pusher {};

struct Breaker {
  bool breaks = false;
  void apply(const TickContext&, Wrenchd& wrench) noexcept {
    if (breaks) wrench.force.x() = kInf;
  }
};

static_assert(StructureReporter<StructureGuard> && StructureReporter<Pusher>);
static_assert(StructureReporter<Veto<std::int16_t>>);
static_assert(!StructureReporter<Cutting<>> && !StructureReporter<DeviceLimits> && !StructureReporter<Damping>);

}  // namespace

TEST_CASE("several guards add their pushes, and the nearer one gives the distance") {
  Bone bone = solid();
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(bone.X_WG() * Vec3d(8_mm, 8_mm, 30_mm)));
  Pusher close{.distance = 0.5, .number = 4, .force = 2};
  OtherPusher far;
  HapticScene scene{bone, kIso, renderer(), close, far, Breaker{}, DeviceLimits{.force = 1}};
  static_assert(decltype(scene)::kReportsStructures);
  const TickResult r = scene.tick({.X_WT = X}, kTick);
  CHECK(r.structures.push.force == Vec3d(3, 0, 0));
  CHECK(r.structures.push.torque == Vec3d(0, 2e-3, 0));
  CHECK(r.structures.nearest == 4);
  CHECK(r.structures.distance == 0.5);
  CHECK(r.wrench.force.norm() == near(1));

  // A wrench that overflows keeps the distance, and pushes no more than it applies.
  scene.part<Breaker>().breaks = true;
  HapticScene unlimited{bone, kIso, renderer(), close, Breaker{.breaks = true}};
  const TickResult broken = unlimited.tick({.X_WT = X}, kTick);
  CHECK(broken.status == Status::kNonFinite);
  CHECK(broken.wrench == Wrenchd::zero());
  CHECK(broken.structures.push == Wrenchd::zero());
  CHECK(broken.structures.nearest == 4);

  // A scene of forces alone has pushes of forces alone.
  HapticScene forces{bone, kIso, renderer(), close, ForceOnly{}};
  CHECK(forces.tick({.X_WT = X}, kTick).structures.push == Wrenchd{Vec3d(2, 0, 0), Vec3d::Zero()});
}

TEST_CASE("a scene without guard and floor leaves the defaults, and a guard fills in while it is off") {
  Bone bone = solid();
  const Posed X = bone.X_WG() * make_pose<double>(Mat3d::Identity(), Vec3d(8_mm, 8_mm, 9_mm));
  HapticScene bare{bone, kIso, renderer(), Cutting{}, DeviceLimits{.force = 3}};
  static_assert(!decltype(bare)::kReportsStructures);
  for (int n = 0; n < 5; ++n) CHECK(is_default(bare.tick({.X_WT = X, .spindle_on = true}, kTick).structures));

  HapticScene scene{bone, kIso, renderer(), StructureGuard{potential()}};
  // At the start the push has not faded in yet.
  const TickResult first = scene.tick({.X_WT = X}, kTick);
  CHECK(first.structures.nearest >= 0);
  CHECK(first.structures.distance < 0);
  CHECK(first.structures.warns);
  CHECK(first.structures.push.force.norm() < 0.017);
  TickResult later;
  for (int n = 0; n < 400; ++n) later = scene.tick({.X_WT = X}, kTick);
  CHECK(later.structures.push.force.norm() > 1);
  TickInput bad{.X_WT = X};
  bad.X_WT.translation().x() = kNaN;
  CHECK(is_default(scene.tick(bad, kTick).structures));
  CHECK(scene.tick({.X_WT = X}, kTick).structures.push.force.norm() > 1);  // as if nothing had been
}

TEST_CASE("a tick that reports structures takes nothing from the heap") {
  if (!AllocationGuard::available()) return;
  Bone bone = solid();
  HapticScene scene{bone, kIso, renderer(), Cutting{}, Veto{floor_of(bone)}, StructureGuard{potential()}};
  Wanderer wanderer(bone, 11);
  double refused = 0;
  const auto calls = heap_calls([&] {
    for (int n = 0; n < 500; ++n) refused += scene.tick(wanderer.next(), kTick).structures.refused_mm3;
  });
  CHECK(calls == 0);
  CHECK(refused > 0);
}

TEST_CASE("a recording carries structures through its file, and replays them bit for bit") {
  Bone bone = solid();
  const auto floor = floor_of(bone);
  HapticScene scene{bone, kIso, renderer(), Cutting{{.rate = 1e6}}, Veto{floor}, StructureGuard{potential()}};
  Wanderer wanderer(bone, 13);
  Recorder recorder(2000);
  int reported = 0;
  for (int n = 0; n < 2000; ++n) {
    const TickInput input = wanderer.next();
    const TickResult r = scene.tick(input, kTick);
    CHECK(recorder.record(input, kTick, r) == RecordStatus::kOk);
    reported += r.structures.refused_mm3 > 0 ? 1 : 0;
  }
  CHECK(reported > 5);
  const std::string path = (std::filesystem::temp_directory_path() / "trephine_tick_summary.bin").string();
  save_recording(path, recorder.ticks());
  const std::vector<RecordedTick> loaded = load_recording(path);
  std::remove(path.c_str());
  REQUIRE(loaded.size() == 2000);

  REQUIRE(bone.restore() == 0);
  floor->reset_counts();
  scene.reset();
  CHECK(replay(loaded, scene).identical());

  // Counts that go on are noticed.
  REQUIRE(bone.restore() == 0);
  scene.reset();
  CHECK_FALSE(replay(loaded, scene).identical());
}
