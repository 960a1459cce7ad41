// SPDX-License-Identifier: MIT
// The coupled tool in fine voxels, where a cut changes more of the bone's surface than a small tool's: it fits its own
// hole, and cuts wait for contact.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/near.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr double kHalfVoxel = 0.5;

/// Volume of a ball that plunged `depth` into a half space [mm³].
double swept_mm3(double R, double depth) {
  return 1e9 * kPi * (depth < R ? depth * depth * (3 * R - depth) / 3 : R * R * (depth - R / 3));
}

/// Bone whose top is a plane across z, for a plunge of a tool of radius R.
struct Block {
  double R, depth, h;
  ImageOptions options{.size = {across(), across(), static_cast<int>(depth / h) + 20}, .spacing = Vec3d::Constant(h)};
  Bone bone = image(HalfSpace{at(0), Vec3d::UnitZ()}, options);

  [[nodiscard]] int across() const { return 2 * static_cast<int>(R / h) + 20; }
  /// Foremost point of a tool so deep in the bone.
  [[nodiscard]] Vec3d at(double deep) const {
    const Vec3d m = options.middle();
    return {m.x(), m.y(), (options.size[2] - 8.5) * h - deep};
  }
  [[nodiscard]] Posed pose(double deep) const { return tool_at(at(deep) + R * Vec3d::UnitZ(), Vec3d::UnitZ()); }
};

struct Plunged {
  double removed = 0, past = 0, step = 0;  // [mm³, voxels, N]
  int other_statuses = 0;
};

template <class Scene>
Plunged plunge(Scene& scene, const Block& block, double speed) {
  Plunged out;
  double force = 0;
  const int ticks = static_cast<int>(block.depth / (speed * kDt));
  for (int i = -20; i < ticks + 300; ++i) {
    const Posed X_WT = block.pose(std::min(block.depth, i * speed * kDt));
    const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = true}, kDt);
    out.removed += r.removed_mm3;
    out.other_statuses += r.status == Status::kOk ? 0 : 1;
    const double past = X_WT.translation().z() - scene.proxy_pose_W().translation().z();
    out.past = std::max(out.past, (past - r.wrench.force.norm() / kK) / block.h);
    out.step = std::max(out.step, std::abs(r.wrench.force.norm() - force));
    force = r.wrench.force.norm();
  }
  return out;
}

TEST_CASE("coupled fine: a large burr in fine voxels cuts the hole that fits it, and says nothing else") {
  constexpr double kRemoved = 0.0027, kSpeed = 20e-3;
  const auto check = [&](const std::string& name, double voxels, double h, double radii, const auto&... parts) {
    const double R = voxels * h;
    Block block{R, radii * R, h};
    const Burr burr{.tip_radius = R, .shaft_radius = R / 2, .shaft_length = 0.040};
    auto scene = coupled_scene(block.bone, burr, Frictionless{}, kGains, parts...);
    const Plunged p = plunge(scene, block, kSpeed);
    const double off = p.removed / swept_mm3(R, block.depth) - 1;
    MESSAGE(name, ", ", voxels, " voxels: removed off by ", off, ", past the device [voxels] ", p.past,
            ", other statuses ", p.other_statuses, ", largest step [N] ", p.step);
    CHECK(std::abs(off) <= kRemoved);
    CHECK(p.past <= 1e-6);
    CHECK(p.other_statuses == 0);
    // At rest the head waits for a bite of some ticks' way.
    CHECK(p.step <= 12 * kK * kSpeed * kDt);
  };
  const CuttingForce cutting({.edges = {.flutes = 8}, .speed = rpm(40'000), .force_scale = 1.0 / 60});
  check("geometric", 30, 1e-4, 1.2, Cutting{});
  check("under pressure", 30, 1e-4, 0.8, Cutting{PressureCut{}, cutting});
  if (kSanitized) return;
  check("rate 1e6", 30, 1e-4, 1.0, Cutting{{.rate = 1e6}});
  check("advancing", 30, 1e-4, 0.8, Cutting{AdvancingCut{.speed = 50e-3}});
  check("geometric", 60, 5e-5, 0.8, Cutting{});
}

// The bound of a tick's work: a large burr makes as few bricks of the surface a tick as its turns allow, and the hand
// cannot tell it from one that cuts all at once. It lags by a round, so its force grows by what the coupling stretches.
TEST_CASE("coupled fine: a burr that cuts in turns has a bound of work a tick, and feels as one that cuts at once") {
  constexpr double kSpeed = 5e-3, h = 1e-4, R = 22 * h;
  struct Felt {
    double removed = 0, mean = 0, ripple = 0, step = 0;  // [mm³, N, N, N]
    double bricks = 0;                                   // most of a tick
    int turns = 0;
  };
  const auto drill = [&](int blocks) {
    Block block{R, 0.7 * R, h};
    const Burr burr{.tip_radius = R, .shaft_radius = R / 2, .shaft_length = 0.040};
    auto scene = coupled_scene(block.bone, burr, Frictionless{}, kGains, Cutting{GeometricCut{}, {.blocks = blocks}});
    const auto surface = shared_bone_surface(block.bone, kIso);
    Felt out;
    std::vector<double> force;
    Vec3d last = Vec3d::Zero();
    const int ticks = static_cast<int>(block.depth / (kSpeed * kDt));
    for (int i = 0; i < ticks + 300; ++i) {
      const std::uint64_t made = surface->changes();
      const double deep = std::min(i, ticks) * kSpeed * kDt;
      const TickResult r = scene.tick({.X_WT = block.pose(deep), .spindle_on = true}, kDt);
      REQUIRE(r.status == Status::kOk);
      out.removed += r.removed_mm3;
      if (i > ticks / 2 && i < ticks) {
        out.bricks = std::max(out.bricks, static_cast<double>(surface->changes() - made));
        out.step = std::max(out.step, (r.wrench.force - last).norm());
        force.push_back(r.wrench.force.norm());
      }
      last = r.wrench.force;
    }
    for (const double f : force) out.mean += f / static_cast<double>(force.size());
    for (const double f : force) out.ripple += (f - out.mean) * (f - out.mean) / static_cast<double>(force.size());
    out.ripple = std::sqrt(out.ripple);
    out.turns = scene.cutting().turn().turns;
    return out;
  };
  const Felt whole = drill(1'000'000), few = drill(CuttingOptions{}.blocks), most = drill(1);
  CHECK(whole.turns == 1);
  CHECK(few.turns == 6);
  CHECK(most.turns == CutTurn::kMost);
  for (const Felt& in_turns : {few, most}) {
    CAPTURE(in_turns.turns);
    MESSAGE(in_turns.turns, " turns: bricks a tick ", in_turns.bricks, " for ", whole.bricks, ", force ", in_turns.mean,
            " for ", whole.mean, " N, ripple ", in_turns.ripple, " for ", whole.ripple, " N, step ", in_turns.step,
            " for ", whole.step, " N, removed ", in_turns.removed / whole.removed);
    CHECK(in_turns.bricks <= 3 * whole.bricks / in_turns.turns);
    // Below what a hand feels of a newton.
    CHECK(in_turns.ripple <= 0.0175);
    CHECK(in_turns.step <= 0.035);
    CHECK(in_turns.mean - whole.mean <= kK * kSpeed * kDt * 1.5 * in_turns.turns);
    CHECK(in_turns.removed == near(whole.removed, 0.002));
  }
}

// Under press a cut leaps ahead of the tool, and nothing more is cut while parts of the surface still wait.
TEST_CASE("coupled fine: a burr in turns that is pressed when its spindle starts sinks in until the hand is free") {
  constexpr double h = 1e-4, R = 22 * h;
  for (const double deep : {0.5e-3, 2e-3}) {
    const auto removed = [&](int blocks) {
      Block block{R, deep, h};
      const Burr burr{.tip_radius = R, .shaft_radius = R / 2, .shaft_length = 0.040};
      auto scene = coupled_scene(block.bone, burr, Frictionless{}, kGains, Cutting{GeometricCut{}, {.blocks = blocks}});
      for (int i = 0; i <= 100; ++i) (void)scene.tick({.X_WT = block.pose(0.01 * i * deep)}, kDt);
      double sum = 0;
      TickResult r;
      for (int i = 0; i < 100; ++i) {
        r = scene.tick({.X_WT = block.pose(deep), .spindle_on = true}, kDt);
        sum += r.removed_mm3;
      }
      CHECK(r.wrench.force.norm() <= 0.01);
      return sum;
    };
    const double whole = removed(1'000'000);
    CHECK(removed(CuttingOptions{}.blocks) == near(whole, 0.001));
    CHECK(removed(1) == near(whole, 0.001));
  }
}

// Along long voxels the rim of the hole that a ball is in must not bulge into it: the ball would rest on it, for good
// or until it slips through.
TEST_CASE("coupled fine: a ball that plunges into long voxels is never held by the rim of its hole" *
          doctest::test_suite("long")) {
  constexpr double kShort = 1e-4, kSpeed = 5e-3;
  constexpr unsigned kSeed = 3170;
  CAPTURE(kSeed);
  Random random(kSeed);
  Figures during, behind, force;
  for (const Vec3d& ratio :
       {Vec3d(1, 1, 2), Vec3d(1, 1, 3), Vec3d(1, 1, 5), Vec3d(1, 2, 2), Vec3d(1, 3, 3), Vec3d(1, 5, 5)})
    for (const double voxels : {6.0, 15.0, 30.0})
      for (const int axis : {0, 2}) {
        if (kSanitized && voxels > 6) continue;
        const double R = voxels * kShort, h = ratio.maxCoeff() * kShort, depth = 1.5 * R;
        ImageOptions o{.spacing = kShort * ratio, .sigma = 0.7 * ratio.maxCoeff()};
        for (int a = 0; a < 3; ++a)
          o.size[static_cast<std::size_t>(a)] =
              static_cast<int>((2 * R + (a == axis ? 0.5 * R : 0) + 12 * h) / o.spacing[a]) + 4;
        const Vec3d up = Vec3d::Unit(axis), top = o.near_middle(random) + 0.5 * depth * up;
        Bone bone = image(HalfSpace{top, up}, o);
        const Burr burr{.tip_radius = R, .shaft_radius = 0.55 * R, .shaft_length = 0.040};
        auto scene = coupled_scene(bone, burr, Frictionless{}, kGains, Cutting{});
        const auto at = [&](double deep) { return tool_at(top + (R - deep) * up, up); };
        const auto left = [&](double deep) {
          return (scene.proxy_pose_W().translation() - at(deep).translation()).norm() / h;
        };
        double most = 0;
        TickResult r;
        for (double deep = -1e-4; deep < depth; deep += kSpeed * kDt) {
          r = scene.tick({.X_WT = at(deep), .spindle_on = true}, kDt);
          most = std::max(most, left(deep));
        }
        for (int i = 0; i < 300; ++i) r = scene.tick({.X_WT = at(depth), .spindle_on = true}, kDt);
        CAPTURE(ratio.transpose());
        CAPTURE(voxels);
        CAPTURE(axis);
        CHECK(most <= kHalfVoxel);
        CHECK(left(depth) <= 0.39);
        CHECK(r.wrench.force.norm() <= 0.1);
        during.add(most);
        behind.add(left(depth));
        force.add(r.wrench.force.norm());
      }
  MESSAGE("behind [long voxels] as it plunges ", during, "; at rest ", behind, ", force [N] ", force);
}

TEST_CASE("coupled fine: all contacts of a large head press on the cutting law") {
  // Pressed by half its radius it has more contacts than the list holds. The law's thrust is their whole force.
  Block block{2.5e-3, 1.5e-3, 1e-4};
  const Burr burr{.tip_radius = block.R, .shaft_radius = 1e-3, .shaft_length = 0.040};
  REQUIRE(carve(block.bone, kIso,
                SphereCutter(block.pose(0).translation(), block.pose(block.depth).translation(), block.R)) > 0);
  auto scene = coupled_scene(block.bone, burr, Frictionless{}, kGains,
                             Cutting{PressureCut{}, CuttingForce(CuttingForce::Options{})});
  const TickResult r = lead(scene, block.pose(-1e-4), block.pose(block.depth + 3e-3), 200);  // the spindle is off
  REQUIRE(scene.renderer().contacts().size() == CoupledConstants::kMaxContacts);
  const double force = r.wrench.force.norm();
  CHECK(std::abs(scene.cutting().law().report().thrust - force) <= 2.2e-15 * force);
}

/// A surface that makes fewer bricks a tick than a renderer asks for.
struct Starved : BoneSurface<std::int16_t> {
  using BoneSurface::BoneSurface;
  int bricks = 0;
  void begin_tick(int) noexcept { BoneSurface::begin_tick(bricks); }
};
struct StarvedView {
  using Scalar = double;
  using Density = std::int16_t;
  Starved* starved;
  [[nodiscard]] Starved& surface() const noexcept { return *starved; }
  [[nodiscard]] const Bone& grid() const noexcept { return starved->grid(); }
  [[nodiscard]] bool is_beyond(const Vec3d& p_G, double radius) const noexcept {
    return BoneSurfaceView<Density>(*starved).is_beyond(p_G, radius);
  }
};

TEST_CASE("coupled fine: where a tick can make few bricks, cuts wait, and the tool neither sinks in nor stays behind") {
  Block block{1.2e-3, 2e-3, 1e-4};
  Starved surface(block.bone, kIso);
  surface.bricks = 20;  // each cut changes more
  const StarvedView view{&surface};
  CoupledToolRenderer<> tool{Burr{.tip_radius = block.R, .shaft_radius = 8e-4, .shaft_length = 0.040}, kGains};
  tool.prepare(view);
  double removed = 0, past = 0, longest_step = 0, force = 0;
  int waited = 0, longest = 0, waits = 0;
  const int ticks = 1000, rest = 500;
  Posed X_cut = block.pose(-1e-4);
  for (int i = 0; i < ticks + rest; ++i) {
    const Posed X_GT = block.pose(std::min(1.0, static_cast<double>(i) / ticks) * (block.depth + 1e-4) - 1e-4);
    const auto r = tool.render(view, X_GT, kDt);
    past = std::max(past, X_GT.translation().z() - tool.proxy_pose().translation().z());
    longest_step = std::max(longest_step, std::abs(r.wrench.force.norm() - force));
    force = r.wrench.force.norm();
    waited = r.evaluated ? 0 : waited + 1;
    waits += r.evaluated ? 0 : 1;
    longest = std::max(longest, waited);
    CHECK((r.evaluated || r.status == Status::kWorkBound));
    if (!r.evaluated) continue;
    const Posed X = tool.cutting_pose(kDt);
    removed +=
        carve(block.bone, kIso, SphereCutter(X_cut.translation(), X.translation(), tool.cutting_head().tip_radius));
    X_cut = X;
  }
  MESSAGE("waited in ", waits, " ticks, at most ", longest, " in a row; past the device [voxels] ", past / block.h,
          ", largest step [N] ", longest_step);
  CHECK(waits > 10);
  CHECK(longest < 6);
  CHECK(past <= 1e-6 * block.h);
  CHECK(longest_step <= kK * 0.2 * block.h);
  CHECK(std::abs(removed / swept_mm3(block.R, block.depth) - 1) <= 0.0097);
}

}  // namespace
