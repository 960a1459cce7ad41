// SPDX-License-Identifier: MIT
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/core/units.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>
#include <trephine/voxel/any_cut.hpp>
#include <trephine/voxel/bone_volume.hpp>
#include <trephine/voxel/cut_floor.hpp>

#include <doctest/doctest.h>

#include <numbers>
#include <random>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

using Grid = VoxelGrid<std::uint8_t>;
constexpr double kVoxel = 3e-4;
const Burr kBurr{.tip_radius = 5 * kVoxel, .shaft_radius = 2 * kVoxel, .shaft_length = 30_mm};

Grid block() {
  return make_grid<std::uint8_t>({.size = {40, 24, 24}, .spacing = Vec3d::Constant(kVoxel), .outside = 0},
                                 [](int, int, int) { return 220; });
}

Posed at(double x, double y = 12, double z = 12) {
  Posed X = Posed::Identity();
  X.translation() = Vec3d(x, y, z) * kVoxel;
  return X;
}

constexpr CutAllowance kOn{.dt = 1e-3, .force_N = 2};

}  // namespace

TEST_CASE("What a scene may list is what the braces say") {
  const Cutting geometric;
  const Cutting braces{};
  const Cutting limited{{.rate = 2e5}};
  const Cutting pressed{RateLimitedCut<>{.rate = 2e5, .reference_force = 3}, {.slope = 10}};
  const Cutting drill{GeometricCut{}, {}, DrillBit{.radius = 1_mm, .length = 8_mm}};
  static_assert(std::same_as<decltype(geometric), const Cutting<GeometricCut>>);
  static_assert(std::same_as<decltype(braces), const Cutting<GeometricCut>>);
  static_assert(std::same_as<decltype(limited), const Cutting<RateLimitedCut<>>>);
  static_assert(std::same_as<decltype(pressed), const Cutting<RateLimitedCut<>>>);
  static_assert(std::same_as<decltype(drill), const Cutting<GeometricCut, NoLaw, DrillBit>>);
  CHECK(limited.policy().rate == 2e5);
  CHECK(pressed.policy().reference_force == 3);

  CHECK_FALSE(geometric.options().follow_probe);
  CHECK(Cutting{GeometricCut{}, {.follow_probe = true}}.options().follow_probe);
}

TEST_CASE("Options that cannot be are refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, inf}) {
    CHECK_THROWS_WITH_AS(Cutting{{.rate = bad}}, doctest::Contains("trephine::RateLimitedCut: rate must be > 0"),
                         std::invalid_argument);
    CHECK_THROWS_AS((Cutting{RateLimitedCut<>{.most_force_factor = bad}}), std::invalid_argument);
    CHECK_THROWS_AS((Cutting{GeometricCut{}, {}, DrillBit{.radius = bad}}), std::invalid_argument);
  }
  for (const double bad : {-1.0, nan, inf}) {
    CHECK_THROWS_WITH_AS((Cutting{GeometricCut{}, {.slope = bad}}), doctest::Contains("trephine::Cutting: slope"),
                         std::invalid_argument);
    CHECK_THROWS_AS((Cutting{RateLimitedCut<>{.reference_force = bad}}), std::invalid_argument);
  }
}

TEST_CASE("A burr cuts its way, once, without memory from the heap") {
  auto grid = block();
  Cutting milling;
  double removed = 0;
  const auto heap = heap_calls([&] { removed = milling.carve(grid, 127.5, at(10), at(14), kBurr, kOn); });
  CHECK(heap == 0);
  const double exact = std::numbers::pi * (4.0 / 3.0 * 125 + 25 * 4) * std::pow(kVoxel * 1e3, 3);
  CHECK(removed == near(exact, 0.02));
  CHECK(milling.carve(grid, 127.5, at(10), at(14), kBurr, kOn) == 0);
}

TEST_CASE("A way beyond the longest sweep is not cut, only its end") {
  const auto cut_between = [](double from, double to) {
    auto grid = make_grid<std::uint8_t>({.size = {60, 12, 12}, .spacing = Vec3d::Constant(kVoxel), .outside = 0},
                                        [](int, int, int) { return 220; });
    Cutting milling;
    (void)milling.carve(grid, 127.5, at(from, 6, 6), at(to, 6, 6), {.tip_radius = 3 * kVoxel}, kOn);
    Cutting drill{GeometricCut{}, {}, DrillBit{.radius = 2 * kVoxel, .length = 4 * kVoxel}};
    const bool middle = grid.at(static_cast<int>((from + to) / 2), 6, 6) < 127;
    const bool end = grid.at(static_cast<int>(to), 6, 6) < 127;
    grid.restore();
    (void)drill.carve(grid, 127.5, at(from, 6, 6), at(to, 6, 6), {}, kOn);
    CHECK((grid.at(static_cast<int>((from + to) / 2), 6, 6) < 127) == middle);
    CHECK(end);
    return middle;
  };
  CHECK(cut_between(10, 10 + kLongestSweep - 1));
  CHECK_FALSE(cut_between(10, 10 + kLongestSweep + 1));
}

TEST_CASE("The grid's place in the world is no matter: poses are in G") {
  std::mt19937 rng(5);
  auto here = block();
  auto there = block();
  there.set_X_WG(make_pose<double>(random_rotation(rng), {0.3, -0.4, 0.5}));
  Cutting milling;
  Cutting other;
  CHECK(milling.carve(here, 127.5, at(10), at(13), kBurr, kOn) ==
        other.carve(there, 127.5, at(10), at(13), kBurr, kOn));
  CHECK(copy_of(here) == copy_of(there));
}

TEST_CASE("A limited milling takes its time, its force and its repeatable dithering") {
  const auto run = [](Cutting<RateLimitedCut<>>& milling, double force, int ticks) {
    auto grid = block();
    double removed = 0;
    for (int t = 0; t < ticks; ++t)
      removed += milling.carve(grid, 127.5, at(12), at(12), kBurr, {.dt = 1e-3, .force_N = force});
    return std::pair{removed, copy_of(grid)};
  };
  Cutting first{RateLimitedCut<>{.rate = 500, .reference_force = 2}};
  Cutting second{RateLimitedCut<>{.rate = 500, .reference_force = 2}};
  const auto a = run(first, 2, 300);
  const auto b = run(second, 2, 300);
  CHECK(a.first == b.first);
  CHECK(a.second == b.second);
  first.reset();
  CHECK(run(first, 2, 300).second == a.second);
  CHECK(run(second, 2, 300).second != a.second);  // its tick counter went on
  second.reset();
  CHECK(run(second, 1, 600).first == near(a.first, 0.01));
  second.reset();
  CHECK(run(second, 0, 300).first == 0);
}

TEST_CASE("Poses that are not finite cut nothing") {
  auto grid = block();
  const auto before = copy_of(grid);
  Cutting milling;
  Cutting drill{GeometricCut{}, {}, DrillBit{}};
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CHECK(milling.carve(grid, 127.5, at(10), at(bad), kBurr, kOn) == 0);
    CHECK(drill.carve(grid, 127.5, at(10), at(bad), kBurr, kOn) == 0);
    // A previous pose that is nowhere is no way: the end is cut.
    auto other = block();
    CHECK(milling.carve(other, 127.5, at(bad), at(10), kBurr, kOn) > 0);
  }
  CHECK(copy_of(grid) == before);
}

TEST_CASE("A tip that goes on cuts what the whole sweep cuts, and sees restored bone") {
  auto step_by_step = block();
  auto anew = block();
  Cutting milling;
  const auto place = [](int t) { return at(8 + 0.31 * t, 12 + 2 * std::sin(0.2 * t), 12 + 1.5 * std::cos(0.17 * t)); };
  double removed = 0;
  double removed_anew = 0;
  for (int t = 0; t < 60; ++t) {
    removed += milling.carve(step_by_step, 127.5, place(std::max(t - 1, 0)), place(t), kBurr, kOn);
    Cutting forgetful;
    removed_anew += forgetful.carve(anew, 127.5, place(std::max(t - 1, 0)), place(t), kBurr, kOn);
    CHECK(milling.carve(step_by_step, 127.5, place(t), place(t), kBurr, kOn) == 0);
    if (t == 30) {
      step_by_step.restore();
      anew.restore();
    }
  }
  // A rounding may fall the other way where two ticks compute the same distance.
  CHECK(removed == near(removed_anew, 1.5e-4));
  const auto a = copy_of(step_by_step);
  const auto b = copy_of(anew);
  int worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(int{a[i]} - int{b[i]}));
  CHECK(worst <= 1);
  // Standing still in bone that came back cuts it again; so does another radius, isovalue or grid.
  step_by_step.restore();
  CHECK(milling.carve(step_by_step, 127.5, place(59), place(59), kBurr, kOn) > 1);
  CHECK(milling.carve(step_by_step, 127.5, place(59), place(59), {.tip_radius = 6 * kVoxel}, kOn) > 1);
  CHECK(milling.carve(step_by_step, 110, place(59), place(59), {.tip_radius = 6 * kVoxel}, kOn) >= 0);
  CHECK(step_by_step.at(26, 12, 12) < 127);
  auto other = block();
  CHECK(milling.carve(other, 110, place(59), place(59), {.tip_radius = 6 * kVoxel}, kOn) > 1);
}

namespace {
/// A renderer that cuts where it is told.
struct Still {
  Posed X = Posed::Identity();
  [[nodiscard]] Posed cutting_pose() const noexcept { return X; }
  [[nodiscard]] const Burr& shape() const noexcept { return kBurr; }
};
}  // namespace

TEST_CASE("Only what cuts is cut: a way with the spindle off is no way that was cut") {
  auto grid = block();
  Cutting milling;
  Still renderer;
  Posed before = at(10);
  const auto cut = [&](double to, bool cuts, bool continues = true) {
    renderer.X = at(to);
    const CutTick tick{.X_GT_before = before, .X_GT = at(to), .continues = continues, .cuts = cuts, .dt = 1e-3};
    before = at(to);
    return milling.cut(grid, 127.5, renderer, tick);
  };
  CHECK(cut(10, true, false) > 1);
  CHECK(cut(20, false) == 0);
  CHECK(cut(20.1, true) > 1);
  CHECK(grid.at(15, 12, 12) > 127);
  CHECK(grid.at(20, 12, 12) < 127);
  renderer.X.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(std::isnan(milling.cut(grid, 127.5, renderer, {.X_GT_before = before, .X_GT = before, .cuts = true})));
}

TEST_CASE("A cut chosen at run time is the same cut, and another one begins as in a new part") {
  const auto drill = [](auto& milling, Grid& grid, double from) {
    double removed = 0;
    for (int t = 0; t < 40; ++t)
      removed += milling.carve(grid, 127.5, at(from + 0.1 * t, 25), at(from + 0.1 * (t + 1), 25), kBurr, kOn);
    return removed;
  };
  const auto same = [&](const auto& policy) {
    auto grid = block(), twin = block();
    Cutting chosen{AnyCut{policy}};
    Cutting fixed{policy};
    const double removed = drill(chosen, grid, 10);
    CHECK(removed > 0);
    CHECK(removed == drill(fixed, twin, 10));
    // Another cut: dithering and the last cut are those of a new part.
    chosen.adopt(RateLimitedCut<>{.rate = 3e3});
    Cutting next{RateLimitedCut<>{.rate = 3e3}};
    CHECK(drill(chosen, grid, 16) == drill(next, twin, 16));
    CHECK(copy_of(grid) == copy_of(twin));
  };
  same(GeometricCut{});
  same(AdvancingCut{.speed = 0.1});
  auto grid = block();
  Cutting nothing{AnyCut{}};
  CHECK(drill(nothing, grid, 10) == 0);
  CHECK_THROWS_AS(AnyCut(AdvancingCut{.speed = -1}).validate(), std::invalid_argument);
  CHECK(AnyCut{}.is_none());
  CHECK(AnyCut{PressureCut{}}.kind() == CutKind::kByPressure);
}

TEST_CASE("A still tip cuts at once what a floor no longer keeps") {
  auto grid = block();
  CutFloor<std::uint8_t> floor(grid, 127.5);
  floor.protect(0, {{0, 0, 0}, {39, 23, 23}}, [](int i, int, int) { return (i - 12.0) * kVoxel; });
  floor.seal(grid);
  Cutting milling;
  const auto cut = [&](CutFloor<std::uint8_t>* f) { return milling.carve(grid, 127.5, at(12), at(12), kBurr, kOn, f); };
  const double half = cut(&floor);
  CHECK(half > 0);
  CHECK(cut(&floor) == 0);
  CHECK(cut(nullptr) == near(half, 0.1));  // the other half of the ball
  CHECK(cut(nullptr) == 0);
}

TEST_CASE_TEMPLATE("A tip that creeps cuts every 256th of a voxel, within that of the whole sweep", Density,
                   std::uint8_t, std::int16_t, float) {
  const auto bone = [] {
    return make_grid<Density>({.size = {28, 24, 24}, .spacing = Vec3d::Constant(kVoxel), .outside = 0},
                              [](int, int, int) { return 220; });
  };
  constexpr double kIso = 127.5, kSlope = 16;
  constexpr double kLeft = kSlope / 256 + (std::is_floating_point_v<Density> ? 1e-3 : 1);  // integers round
  for (const double step : {1.0 / 2048, 1.0 / 700, 1.0 / 200}) {
    auto creeping = bone(), whole = bone();
    Cutting milling{GeometricCut{}, {.slope = kSlope}};
    const int ticks = static_cast<int>(2 / step);
    double told = milling.carve(creeping, kIso, at(12), at(12), kBurr, kOn);
    const auto edits = creeping.edit_count();
    for (int t = 0; t < ticks; ++t)
      told += milling.carve(creeping, kIso, at(12 + t * step), at(12 + (t + 1) * step), kBurr, kOn);
    // A tick less than 1/256 voxel from the last cut changes nothing.
    const auto most = static_cast<std::uint64_t>(std::min(2 * 256 + 1, ticks));
    CHECK(creeping.edit_count() - edits <= most);
    Cutting at_once{GeometricCut{}, {.slope = kSlope}};
    const double truth = at_once.carve(whole, kIso, at(12), at(12 + ticks * step), kBurr, kOn);
    CHECK(told == near(truth, 2e-3));
    const auto a = copy_of(creeping), b = copy_of(whole);
    double worst = 0, least = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      worst = std::max(worst, double(a[i]) - double(b[i]));
      least = std::min(least, double(a[i]) - double(b[i]));
    }
    CHECK(worst <= kLeft);
    CHECK(least >= -(std::is_floating_point_v<Density> ? 1e-4 : 1));
  }
}

TEST_CASE("A tip that waits cuts at once where bone came back, or itself, the isovalue or its place changed") {
  constexpr double kStep = 1.0 / 2048;
  const Burr wider{.tip_radius = 6 * kVoxel};
  auto grid = block();
  Cutting milling;
  const auto creep = [&](double from, const Burr& burr, double iso = 127.5) {
    return milling.carve(grid, iso, at(from), at(from + kStep), burr, kOn);
  };
  REQUIRE(milling.carve(grid, 127.5, at(12), at(12), kBurr, kOn) > 1);
  REQUIRE(creep(12, kBurr) == 0);
  grid.restore();
  CHECK(creep(12 + kStep, kBurr) > 1);
  REQUIRE(creep(12 + 2 * kStep, kBurr) == 0);
  CHECK(creep(12 + 3 * kStep, wider) > 1);
  REQUIRE(creep(12 + 4 * kStep, wider) == 0);
  CHECK(creep(12 + 5 * kStep, wider, 80) > 1);
  const auto edits = grid.edit_count();
  REQUIRE(creep(12 + 6 * kStep, wider, 80) == 0);
  CHECK(grid.edit_count() == edits);
  // A jump: the poses before and after are equal, and elsewhere.
  CHECK(milling.carve(grid, 80, at(22), at(22), wider, kOn) > 1);
  // Back where it was, a hair beside: what it cuts from there on is ahead of this place.
  CHECK(milling.carve(grid, 80, at(12.5), at(12.5), wider, kOn) > 0.1);
  CHECK(milling.carve(grid, 80, at(12.5), at(16), wider, kOn) > 0.01);
  // A grid that moved carries its cuts along: poses are in G.
  grid.restore();
  REQUIRE(milling.carve(grid, 80, at(16), at(16), wider, kOn) > 1);
  grid.set_X_WG(make_pose<double>(Mat3d::Identity(), {0.1, 0.2, 0.3}));
  CHECK(milling.carve(grid, 80, at(16), at(16 + kStep), wider, kOn) == 0);
  CHECK(milling.carve(grid, 80, at(16 + kStep), at(18), wider, kOn) > 0.1);
  // In another grid nothing is cut yet.
  auto other = block();
  CHECK(milling.carve(other, 80, at(18), at(18), wider, kOn) > 1);
}

TEST_CASE("A bit that waits does not touch the grid, and cuts at once where bone came back or it turned") {
  const DrillBit bit{.radius = 5 * kVoxel, .length = 8 * kVoxel};
  auto grid = block();
  Cutting milling{GeometricCut{}, {}, bit};
  const auto turned = [](double by) {
    Posed X = at(14);
    X.linear() = Eigen::AngleAxisd(by, Vec3d::UnitX()).toRotationMatrix();
    return X;
  };
  REQUIRE(milling.carve(grid, 127.5, turned(0), turned(0), {}, kOn) > 1);
  const auto edits = grid.edit_count();
  CHECK(milling.carve(grid, 127.5, turned(0), turned(0), {}, kOn) == 0);
  CHECK(milling.carve(grid, 127.5, turned(0), turned(1e-4), {}, kOn) == 0);
  CHECK(grid.edit_count() == edits);
  CHECK(milling.carve(grid, 127.5, turned(1e-4), turned(0.1), {}, kOn) > 0.1);
  grid.restore();
  CHECK(milling.carve(grid, 127.5, turned(0.1), turned(0.1), {}, kOn) > 1);
}

namespace {

/// A head of 18 by 24 by 12 voxels' radius that cuts in turns, as it may cut few blocks a tick.
struct InTurns {
  static constexpr double kRadius = 18 * kVoxel;
  Burr burr{.tip_radius = kRadius, .shaft_radius = 2 * kVoxel, .shaft_length = 30_mm};
  Vec3d spacing{kVoxel, 0.75 * kVoxel, 1.5 * kVoxel};
  VoxelGrid<float> bone =
      make_grid<float>({.size = {90, 100, 60}, .spacing = spacing, .outside = 0}, [](int, int, int) { return 1000.0; });
  trephine::detail::CuttingPath<ToolHead> path{};
  static constexpr double kBall_mm3 = 4.0 / 3.0 * std::numbers::pi * kRadius * kRadius * kRadius * 1e9;

  [[nodiscard]] Posed pose(const Vec3d& voxels) const {
    Posed X = Posed::Identity();
    X.translation() = voxels.cwiseProduct(spacing);
    return X;
  }
  double tick(const Posed& before, const Posed& now, int blocks, const void* rule = nullptr) {
    path.begin_turn(burr, spacing, blocks);
    return path.carve(bone, 500, before, now, burr, GeometricCut{}, kOn, 0, rule, path.turn());
  }
  /// Volume of bone [mm3].
  [[nodiscard]] double volume() const {
    BoneVolume<float> all(bone, 500);
    for (int k = -1; k < bone.size()[2]; ++k)
      for (int j = -1; j < bone.size()[1]; ++j) all.add_row(j, k, -1, bone.size()[0] - 1);
    return all.cells() * spacing.prod() * 1e9;
  }
};

/// Largest difference of two grids' densities.
double difference(const VoxelGrid<float>& a, const VoxelGrid<float>& b) {
  double most = 0;
  const auto& size = a.size();
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        most = std::max(most, std::abs(static_cast<double>(a.at(i, j, k)) - static_cast<double>(b.at(i, j, k))));
  return most;
}

}  // namespace

TEST_CASE("A head takes as many turns as its blocks need, a small one none") {
  const auto turns = [](double radius, const Vec3d& spacing, int blocks) {
    trephine::detail::CuttingPath<ToolHead> path;
    path.begin_turn(Burr{.tip_radius = radius}, spacing, blocks);
    return path.turn().turns;
  };
  const auto cubes = [](double h) -> Vec3d { return Vec3d::Constant(h); };
  CHECK(turns(3_mm, cubes(0.4_mm), CuttingOptions{}.blocks) == 1);
  CHECK(turns(1.5_mm, cubes(0.15_mm), CuttingOptions{}.blocks) == 1);
  CHECK(turns(3_mm, cubes(0.1_mm), CuttingOptions{}.blocks) == 12);  // 8,129 blocks
  CHECK(turns(3_mm, cubes(0.1_mm), 8130) == 1);
  CHECK(turns(3_mm, cubes(0.05_mm), CuttingOptions{}.blocks) == CutTurn::kMost);
  CHECK(turns(3_mm, {0.1_mm, 0.1_mm, 0.2_mm}, CuttingOptions{}.blocks) == 6);
  CHECK(turns(3_mm, {0.2_mm, 0.1_mm, 0.1_mm}, CuttingOptions{}.blocks) == 8);
  CHECK_THROWS_WITH_AS((Cutting{GeometricCut{}, {.blocks = 0}}), doctest::Contains("blocks must be at least 1"),
                       std::invalid_argument);
}

TEST_CASE("A cut in turns leaves what a whole one leaves, a round later, and its volumes add up") {
  std::mt19937 rng(20262);
  for (const int blocks : {900, 400, 100}) {
    CAPTURE(blocks);
    InTurns turns, whole;
    const double before = turns.volume();
    const Vec3d start(30, 40, 50), way = 25 * random_direction(rng);
    constexpr int kTicks = 60;
    double removed = 0, at_once = 0;
    Posed last = turns.pose(start);
    for (int i = 0; i < kTicks + CutTurn::kMost; ++i) {
      const Posed now = turns.pose(start + std::min(1.0, i / double{kTicks}) * way);
      removed += turns.tick(last, now, blocks);
      at_once += whole.tick(last, now, 1'000'000);
      last = now;
    }
    REQUIRE(whole.path.turn().turns == 1);
    CHECK(turns.path.turn().turns > (blocks > 800 ? 2 : 4));
    // A later turn goes straight through what several ticks of a whole cut do.
    CHECK(difference(turns.bone, whole.bone) < 0.01);
    CHECK(removed == near(before - turns.volume(), 1e-6));
    CHECK(removed == near(at_once, 1e-5));
  }
}

TEST_CASE("Each turn cuts its own voxels alone, and all turns about as many") {
  InTurns in;
  const Vec3d middle(45, 50, 30);
  std::vector<int> changed;
  const Posed X = in.pose(middle);
  for (int t = 0; t < CutTurn::kMost; ++t) {
    const VoxelGrid<float> before = in.bone.copy();
    in.tick(X, X, 50);
    const CutTurn turn = in.path.turn();
    REQUIRE(turn.turns == CutTurn::kMost);
    int count = 0, others = 0;
    for (int k = 0; k < 60; ++k)
      for (int j = 0; j < 100; ++j)
        for (int i = 0; i < 90; ++i)
          if (in.bone.at(i, j, k) != before.at(i, j, k)) (turn.has(i, j, k) ? count : others) += 1;
    CHECK(others == 0);
    changed.push_back(count);
  }
  int sum = 0, most = 0;
  for (const int n : changed) {
    sum += n;
    most = std::max(most, n);
  }
  CHECK(most < 2.5 * sum / CutTurn::kMost);
}

TEST_CASE("A fast head in turns leaves no bone in its way") {
  InTurns turns, whole;
  Posed last = turns.pose({20, 40, 30});
  const auto go = [&](const Posed& now) {
    turns.tick(last, now, 100);
    whole.tick(last, now, 1'000'000);
    last = now;
  };
  // Round a corner, which a turn that waited before it would cut off.
  for (int i = 1; i <= 2; ++i) go(turns.pose({20.0 + 15 * i, 40, 30}));
  for (int i = 1; i <= 2; ++i) go(turns.pose({50, 40 + 20.0 * i, 30}));
  CHECK(turns.path.turn().turns > 10);
  for (int i = 0; i < CutTurn::kMost; ++i) go(last);
  CHECK(difference(turns.bone, whole.bone) < 0.01);
}

TEST_CASE("All turns cut anew where bone came back, or the rule, the place or the head's size changed") {
  InTurns in;
  in.bone = make_grid<float>({.size = {90, 100, 60}, .spacing = in.spacing, .outside = 0},
                             [](int, int, int) { return 1000.0; }, {.keep_original = true});
  const Posed X = in.pose({45, 50, 30});
  const auto round = [&](const void* rule = nullptr) {
    double removed = 0;
    for (int t = 0; t < CutTurn::kMost; ++t) removed += in.tick(X, X, 100, rule);
    return removed;
  };
  CHECK(round() == near(InTurns::kBall_mm3, 0.01));
  CHECK(round() == 0);
  in.bone.restore();
  in.tick(X, X, 100);  // in the middle of a round
  in.bone.restore();
  CHECK(round() == near(InTurns::kBall_mm3, 0.01));
  const int rule = 0;
  in.bone.restore();
  CHECK(round(&rule) == near(InTurns::kBall_mm3, 0.01));
  in.burr.tip_radius *= 1.05;
  const double shell = std::pow(1.05, 3) - 1;
  CHECK(round(&rule) == near(shell * InTurns::kBall_mm3, 0.02));
}

TEST_CASE("Cuts in time take in turns what they take at once") {
  const auto removed = [](int blocks, const auto& policy, bool is_sharp = false) {
    InTurns in;
    const auto blurred = [](int, int, int k) { return std::clamp(500 + 333.0 * (52 - k), 0.0, 1000.0); };
    if (!is_sharp) in.bone = make_grid<float>({.size = {90, 100, 60}, .spacing = in.spacing, .outside = 0}, blurred);
    double sum = 0;
    Posed last = in.pose({35, 45, 60});
    constexpr int kTicks = 160;
    for (int i = 0; i < kTicks + CutTurn::kMost; ++i) {
      // The last round only takes what it still may.
      const CutAllowance tick = i < kTicks ? CutAllowance{.dt = 1e-3, .force_N = 2, .fraction = 0.05}
                                           : CutAllowance{.dt = 0, .force_N = 2, .fraction = 0};
      const double way = 0.05 * std::min(i, kTicks - 1);
      const Posed now = in.pose({35 + way, 45, 60 - way});
      in.path.begin_turn(in.burr, in.spacing, blocks);
      sum += in.path.carve(in.bone, 500, last, now, in.burr, policy, tick, 0, nullptr, in.path.turn());
      last = now;
    }
    return sum;
  };
  const auto check = [&](const auto& policy) {
    const double whole = removed(1'000'000, policy);
    CHECK(whole > 1);
    CHECK(removed(250, policy) == near(whole, 0.03));
  };
  check(RateLimitedCut<>{.rate = 2e4});
  check(AdvancingCut{.speed = 5e-3});
  check(PressureCut{});
  // A longer step takes more of an image's sharp edges.
  const AdvancingCut sharp{.speed = 5e-3};
  CHECK(removed(250, sharp, true) == near(removed(1'000'000, sharp, true), 1.0 / 6));
}

TEST_CASE("A program's own cut is whole, also where a scene's would take turns") {
  InTurns in;
  Cutting cutting{GeometricCut{}, {.blocks = 1}};
  const Posed X = in.pose({45, 50, 30});
  CHECK(cutting.carve(in.bone, 500, X, X, in.burr, kOn) == near(InTurns::kBall_mm3, 0.01));
}

TEST_CASE("What is left out takes no bytes") {
  // Options, the counter of cuts, the poses of the last tick, and for each turn where it cut last and what it may cut;
  // a geometric cut remembers where it bit last.
  constexpr std::size_t kPath = CutTurn::kMost * (sizeof(Posed) + sizeof(CutAllowance) + alignof(Posed)) +
                                2 * sizeof(Posed) + 80 + 4 * alignof(Posed);
  static_assert(sizeof(Cutting<RateLimitedCut<>>) <= sizeof(RateLimitedCut<>) + sizeof(CuttingOptions) + kPath);
  static_assert(sizeof(Cutting<>) <= sizeof(CuttingOptions) + sizeof(Posed) + 32 + kPath);
}
