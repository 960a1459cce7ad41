// SPDX-License-Identifier: MIT
// The vibration of cutting teeth: under a cutting force in closed form, and in whole scenes.
#include "fakes.hpp"
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/spectrum.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_vibration.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 7043;
constexpr double kTurn = 2 * std::numbers::pi;

/// Cutting whose report is given, in place of bone.
struct GivenCutting {
  static constexpr bool kUsesTwist = false;
  CuttingForce::Options given{};
  CuttingReport now{};
  int resets = 0;
  [[nodiscard]] const CuttingForce::Options& options() const noexcept { return given; }
  [[nodiscard]] const CuttingReport& report() const noexcept { return now; }
  void adopt(const CuttingForce::Options& options) noexcept { given = options; }
  void reset() noexcept { ++resets; }
  void apply(const TickContext&, Wrenchd& wrench) noexcept { wrench += given.force_scale * now.edges; }
};
using Vibration = CuttingVibration<>;
static_assert(Stage<Vibration> && !kStageUsesTwist<Vibration> && std::derived_from<Vibration, CuttingForce>);
static_assert(Tunable<Vibration> && Tunable<CuttingVibration<Remote<CuttingForce>>>);
static_assert(!kStageUsesTwist<CuttingVibration<GivenCutting>> && ReportingCutting<GivenCutting> &&
              !ReportingCutting<Add>);

/// A tick of a stage alone.
template <class S>
Wrenchd tick(S& stage, double dt) {
  const TickInput input{.spindle_on = true};
  const Posed X_WG = Posed::Identity();
  TickContext context{input, X_WG};
  context.dt = dt;
  Wrenchd wrench;
  stage.apply(context, wrench);
  stage.vibrate(context, wrench);
  return wrench;
}

TEST_CASE("cutting vibration: force and torque have the lines of the teeth about the same mean, by load and share") {
  CAPTURE(kSeed);
  Random random(kSeed);
  double off = 0, others = -1e3, mean_off = 0;
  int count = 0;
  for (int run = 0; run < cases(160); ++run) {
    const double rate = run % 4 == 0 ? 4e3 : run % 4 == 1 ? 1e3 : 10e3;
    GivenCutting cutting;
    const int z = cutting.given.edges.flutes = 2 + random.below(15);
    cutting.given.force_scale = random.uniform(0.05, 1);
    cutting.now.spindle = rpm(5e3 * std::pow(4, random.uniform()));
    cutting.now.edges.force = random.arrow(0.1, 5);
    cutting.now.edges.torque = random.arrow(0.001, 0.01);
    const double depth = random.uniform(0.1, 1), felt = cutting.given.force_scale,
                 f = cutting.now.spindle * z / kTurn / rate;
    const ToothPattern pattern{.arc = random.uniform(0.1, 1)};
    CuttingVibration vibration{cutting, {.depth = depth, .pattern = pattern}};
    const Vec3d along = cutting.now.edges.force.normalized(), about = cutting.now.edges.torque.normalized();
    std::vector<double> force, torque;
    for (int i = 0; i < 2048; ++i) {
      const Wrenchd w = tick(vibration, 1 / rate);
      force.push_back(w.force.dot(along) / (felt * cutting.now.edges.force.norm()));
      torque.push_back(w.torque.dot(about) / (felt * cutting.now.edges.torque.norm()));
      if (f >= 0.4) CHECK(w == felt * cutting.now.edges);
    }
    if (f >= 0.4) continue;
    const Spectrum of_force(force), of_torque(torque);
    for (int m = 1; m * f <= 0.1; ++m) {
      const double x = m * z * pattern.arc / 2, q = 2 * x / std::numbers::pi;
      const double expected = depth * std::abs(2 * std::cos(x) / (1 - q * q));
      if (expected < 1e-2 * depth) continue;
      for (const double got : {of_force.at(m * f), of_torque.at(m * f)})
        off = std::max(off, std::abs(decibel(got / expected)));
      ++count;
    }
    mean_off = std::max(mean_off, std::abs(of_force.at(0) - 1));
    double strongest = 0, most = 0;
    for (int i = Spectrum::kLobe + 1; i < of_force.bins(); ++i) {
      const double line = std::remainder(i / 2048.0, f);
      double& kind = std::abs(line) * 2048 < Spectrum::kLobe + 0.5 ? strongest : most;
      kind = std::max(kind, of_force.bin(i));
    }
    if (strongest > 1e-3) others = std::max(others, decibel(most / strongest));
  }
  MESSAGE(count, " lines off their coefficient by at most [dB] ", off, "; others below the strongest [dB] ", others,
          "; mean off by ", mean_off);
  CHECK(count > cases(160) / 8);
  CHECK(off < 5e-5);
  CHECK(others < -80);
  CHECK(mean_off < 2.6e-6);
}

TEST_CASE("cutting vibration: work by random motion stays within its bounds, and grows with nothing at rest") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  double steady = 0;
  for (int run = 0; run < cases(160); ++run) {
    GivenCutting cutting;
    cutting.given.edges.flutes = 1 + random.below(16);
    cutting.given.force_scale = 0.2;
    cutting.now.spindle = rpm(5e3 * std::pow(4, random.uniform()));
    const double dt = run % 2 == 0 ? 1e-4 : 1e-3, depth = 0.7;
    cutting.now.edges.force = random.arrow(1, 5);
    CuttingVibration vibration{cutting, {.depth = depth, .pattern = {.runout = run % 3 == 0 ? 0.3 : 0.0}}};
    const double advance = cutting.now.spindle * dt;
    const double most = depth * vibration.lines().peak(advance), sum = depth * vibration.lines().sum_bound(advance);
    const bool moves = run % 4 != 3;  // else at constant velocity
    Vec3d v = random.arrow(0, 0.1);
    double work = 0, path = 0, variation = 0, before = 0, worst = 0;
    int over = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3d mean = 0.2 * cutting.now.edges.force;
      const double u = mean.dot(v) * dt;
      if (i > 0) variation += std::abs(u - before);
      before = u;
      work += (tick(vibration, dt).force - mean).dot(v) * dt;
      path += std::abs(u);
      worst = std::max(worst, std::abs(work));
      over += std::abs(work) > sum * (std::abs(u) + variation) + 1e-15;
      over += std::abs(work) > most * path + 1e-15;
      if (moves) v += random.arrow(0, 0.003) - 0.02 * v;
    }
    CHECK(over == 0);
    if (!moves && most > 0) steady = std::max(steady, worst / (most * path));
  }
  CHECK(steady < 3.3e-4);
}

TEST_CASE("cutting vibration: slows with the spindle, follows new teeth, and resets") {
  GivenCutting cutting;
  cutting.given.edges.flutes = 4;
  cutting.now.edges.force = Vec3d(1, 0, 0);
  cutting.now.spindle = rpm(6000);  // 100 Hz
  CuttingVibration vibration{cutting, {}};
  auto& inner = static_cast<GivenCutting&>(vibration);
  const auto loudest = [&] {
    std::vector<double> x;
    for (int i = 0; i < 4096; ++i) x.push_back(tick(vibration, 1e-4).force.x());
    const Spectrum s(x);
    int best = Spectrum::kLobe + 1;
    for (int i = best; i < s.bins(); ++i)
      if (s.bin(i) > s.bin(best)) best = i;
    return best * 1e4 / 4096;
  };
  CHECK(loudest() == near(400, 0.0029));
  inner.now.spindle = rpm(4500);
  CHECK(loudest() == near(300, 0.0029));
  CuttingForce::Options other = inner.given;
  other.edges.flutes = 6;
  vibration.adopt(other);
  CHECK(loudest() == near(450, 0.0052));
  other.edges.kind = CuttingEdges::Kind::kDiamond;
  vibration.adopt(other);
  CHECK(loudest() == near(75, 0.01));  // grains have lines at each order of the spindle
  other.edges = {.flutes = 4};
  vibration.adopt(other);
  vibration.reset();
  CHECK(inner.resets == 1);
  CHECK(vibration.factor() == 1);
  const Wrenchd first = tick(vibration, 1e-4);
  for (int i = 0; i < 7; ++i) static_cast<void>(tick(vibration, 1e-4));
  vibration.reset();
  CHECK(tick(vibration, 1e-4) == first);
  // Without load and without turning.
  inner.now.edges = Wrenchd::zero();
  CHECK(tick(vibration, 1e-4) == Wrenchd::zero());

  const double nan = kNaN;
  for (const double bad : {-0.1, 1.5, nan})
    check_refused("depth", [&] { CuttingVibration{GivenCutting{}, {.depth = bad}}; });
  check_refused("arc", [&] { CuttingVibration{GivenCutting{}, {.pattern = {.arc = 0}}}; });
  Mailbox<Vibration::Options> box;
  check_refused("depth", [&] { box.post({.depth = 2}); });
}

/// A cylinder that mills a slot along x.
struct SlotScene {
  static constexpr double kIso = 350, kDepth = 1.5e-3;
  static constexpr int kSize = 46;
  static constexpr double kSpacing = 3e-4;
  NamedTool tool = tool_by_name("cylinder-3");
  Vec3d middle = Vec3d::Constant(kSpacing * (kSize - 1) / 2);
  VoxelGrid<std::int16_t> bone =
      rasterise<std::int16_t>(HalfSpace{middle, Vec3d::UnitZ()}, {.size = {kSize, kSize, kSize},
                                                                  .spacing = Vec3d::Constant(kSpacing),
                                                                  .blur = 0.7,
                                                                  .contrast = 2700,
                                                                  .air = -1000});
  [[nodiscard]] CuttingForce::Options options() const {
    return {
        .edges = tool.edges, .speed = rpm(5000), .strength = {.soft = -1000, .cortical = 1700}, .force_scale = 0.05};
  }
  [[nodiscard]] TickInput input(double x) const {
    const Vec3d at(x, middle.y(), middle.z() + tool.tool.burr().tip_radius - kDepth);
    return {.X_WT = tool_at(at, Vec3d::UnitZ()), .spindle_on = true};
  }
  template <class Law>
  [[nodiscard]] auto scene(const Law& law) {
    return HapticScene{bone, kIso, CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                       Cutting{PressureCut{}, law}};
  }
};

TEST_CASE("cutting vibration: in a scene it only multiplies the edges' wrench, and takes no memory") {
  SlotScene with, without;
  CuttingForce::Options o = with.options();
  o.stall_torque = 0.03;
  auto vibrating = with.scene(CuttingVibration{CuttingForce(o), {}});
  auto plain = without.scene(CuttingForce(o));
  const auto& part = vibrating.cutting().law();
  double swing = 0;
  int different = 0;
  for (int i = 0; i < 1500; ++i) {
    const TickInput input = with.input(-2e-3 + i * 4e-6);
    const AllocationGuard guard;
    const TickResult a = vibrating.tick(input, 1e-3);
    const auto allocations = guard.allocations() + guard.frees();
    CHECK(allocations == 0);
    const TickResult b = plain.tick(input, 1e-3);
    REQUIRE(a.status == b.status);
    different += a.removed_mm3 != b.removed_mm3 || !(part.report().edges == plain.cutting().law().report().edges);
    const Wrenchd expected = (part.factor() - 1) * o.force_scale * part.report().edges;
    CHECK((a.wrench.force - b.wrench.force - expected.force).norm() < 1e-14);
    CHECK((a.wrench.torque - b.wrench.torque - expected.torque).norm() < 1e-17);
    swing = std::max(swing, expected.force.norm());
  }
  CHECK(different == 0);
  CHECK(swing > 0.01);
}

TEST_CASE("cutting vibration: other threads change the cutting's options, and the vibration's") {
  SlotScene slot;
  Mailbox<CuttingForce::Options> cutting_box;
  Mailbox<Vibration::Options> box;
  auto inside = slot.scene(CuttingVibration{Remote{CuttingForce(slot.options()), cutting_box}, {}});
  auto outside = slot.scene(Remote{CuttingVibration{CuttingForce(slot.options()), {}}, box});
  CuttingForce::Options o = slot.options();
  o.edges.flutes = 11;
  cutting_box.post(o);
  box.post({.depth = 0.25});
  REQUIRE(inside.tick(slot.input(-3e-3), 1e-3).status == Status::kOk);
  REQUIRE(outside.tick(slot.input(-3e-3), 1e-3).status == Status::kOk);
  CHECK(inside.cutting().law().options().edges.flutes == 11);
  CHECK(inside.cutting().law().lines().teeth() == 11);
  CHECK(outside.cutting().law().vibration().depth == 0.25);
}

TEST_CASE("cutting vibration: in bone at 10 kHz lines below 1 kHz are within 1 dB, the rest 40 dB below") {
  if (kSanitized) return;
  SlotScene slot;
  const ToothPattern pattern{.arc = 0.6};
  auto scene = slot.scene(CuttingVibration{CuttingForce(slot.options()), {.pattern = pattern}});
  const int z = slot.tool.edges.flutes;
  constexpr int n = 4096;
  constexpr double rate = 10e3, speed = 4e-3;
  std::vector<double> torque;
  double mean = 0, x = -2e-3;
  while (static_cast<int>(torque.size()) < n) {
    const bool steady = x > 3e-3;
    const double dt = steady ? 1 / rate : 1e-3;
    x += speed * dt;
    REQUIRE(scene.tick(slot.input(x), dt).status == Status::kOk);
    if (!steady) continue;
    const auto& part = scene.cutting().law();
    torque.push_back(part.factor() * part.report().torque);
    mean += part.report().torque / n;
  }
  const Spectrum spectrum(torque);
  const double f = z * 5000 / 60.0 / rate;
  double strongest = 0;
  for (int m = 1; m * f <= 0.1; ++m) {
    const double half = m * z * pattern.arc / 2, q = 2 * half / std::numbers::pi;
    const double expected = mean * std::abs(2 * std::cos(half) / (1 - q * q)), got = spectrum.at(m * f);
    MESSAGE(z, " teeth, line at ", m * f * rate, " Hz: ", got / mean, " of the mean torque, ", decibel(got / expected),
            " dB off");
    CHECK(std::abs(decibel(got / expected)) < 0.0079);
    strongest = std::max(strongest, got);
  }
  // The load's own changes stand at low frequencies, and as far from each line.
  constexpr double apart = 100 / rate;
  double most = 0;
  for (int i = 0; i < spectrum.bins(); ++i) {
    const double at = i / static_cast<double>(n);
    if (std::abs(std::remainder(at, f)) > apart) most = std::max(most, spectrum.bin(i));
  }
  MESSAGE("others: ", decibel(most / strongest), " dB");
  CHECK(strongest > 0);
  CHECK(most < 0.001 * strongest);
}

}  // namespace
