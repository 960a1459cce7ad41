// SPDX-License-Identifier: MIT
#include "render/all_elements.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/poses.hpp"
#include "support/profile.hpp"
#include "support/raster.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/coupled/broad_phase.hpp>
#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/voxel/carving.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <map>
#include <set>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 306;
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};
constexpr double kTouching = 1e-5;
using Grid = VoxelGrid<std::uint8_t>;
using Surface = BoneSurface<std::uint8_t>;

double distance(const BallAndShaft& shape, const Posed& X, const Vec3d& q) {
  const Vec3d in_T = X.inverse() * q;
  return profile_at(shape, in_T.head<2>().norm(), in_T.z()).distance;
}

/// Direction in which the distance grows, by differences.
Vec3d gradient(const BallAndShaft& shape, const Posed& X, const Vec3d& q) {
  constexpr double kStep = 1e-7;
  Vec3d g;
  for (int a = 0; a < 3; ++a)
    g[a] = distance(shape, X, q + kStep * Vec3d::Unit(a)) - distance(shape, X, q - kStep * Vec3d::Unit(a));
  return g.normalized();
}

Posed moved(const Posed& X, const Vec3d& way, const Vec3d& turn) {
  return make_pose<double>(rotation_from_vector(turn) * X.linear(), X.translation() + way);
}

/// Two tools that take turns on one surface.
struct Turns {
  Surface& surface;
  Random& random;
  Vec3d middle;
  double room;  // how far from the middle they are [m]
  std::array<BroadPhase, 2> near{};
  std::array<Posed, 2> X{};

  Turns(Surface& of, Random& numbers, const RasterOptions& o)
      : surface(of), random(numbers), middle(o.middle()), room(0.4 * o.size[0] * o.spacing[0]) {
    for (std::size_t t = 0; t < 2; ++t) {
      near[t].reserve(surface.view(), kTouching);
      X[t] = random_pose(random, middle, room);
    }
  }
  /// Moves the next one, a little or anywhere, and updates its list; returns its number.
  std::size_t go(const BallAndShaft& shape, int i) {
    const auto t = static_cast<std::size_t>(i % 2);
    const Vec3d way = random.arrow(0, 4e-4), turn = random.arrow(0, 0.05);
    X[t] = i % 10 < 3 ? random_pose(random, middle, i % 4 < 2 ? room : 2 * room) : moved(X[t], way, turn);
    bool updated = false;
    const auto update = [&] {
      surface.begin_tick();
      updated = near[t].update(surface.view(), shape, X[t], {way.norm(), turn.norm()});
    };
    for (int tick = 0; tick < 20 && !updated; ++tick) CHECK(heap_calls(update) == 0);
    REQUIRE(updated);
    return t;
  }
};

// By brute force over all elements of the surface.
TEST_CASE("broad phase: a list holds every element in contact, and its clearance is free, after any cut") {
  CAPTURE(kSeed);
  Random random(kSeed);
  const BallAndShaft shape(kDrill);
  int visits = 0, missed = 0, cuts = 0;
  Figures shares;
  for (const double h : {3e-4, 1e-4}) {
    const int side = h > 2e-4 ? 48 : 96;
    const RasterOptions o{.size = {side, side, side}, .spacing = Vec3d::Constant(h)};
    auto bone = rasterise<std::uint8_t>(Ball{o.middle(), 0.12 * side * h}, o);
    Surface surface(bone, o.isovalue());
    Turns turns(surface, random, o);
    auto all = all_elements(bone, o.isovalue());
    for (int i = 0; i < 300; ++i) {
      if (i % 25 == 0) {
        const Vec3d at = o.middle() + random.arrow(0.1 * side * h, 0.12 * side * h);
        cuts += carve(bone, o.isovalue(), SphereCutter(at, at, 2 * h)) > 0 ? 1 : 0;
        all = all_elements(bone, o.isovalue());
      }
      // Beside the bone at some height of the shaft, every other time.
      const auto now = static_cast<std::size_t>(i % 2);
      if (i % 4 < 2) {
        const Vec3d n = random.unit(), axis = n.cross(random.unit()).normalized();
        const double gap = random.uniform(0, 3e-3), height = random.uniform(0, 0.018);
        turns.X[now] = tool_at(o.middle() + (0.12 * side * h + kDrill.shaft_radius + gap) * n - height * axis, axis);
      }
      const std::size_t t = turns.go(shape, i);
      const Posed& X = turns.X[t];
      std::set<std::uint64_t> found;
      const Clearance clear = turns.near[t].elements().for_each_candidate(
          shape, X, 0.5,
          [&](const NearBlock& block, std::size_t k, const Vec3<float>&) { found.insert(block.key(k)); });
      visits += static_cast<int>(found.size());
      std::map<double, Vec3d> free;  // elements that do not touch, by their distance
      for (const auto& [key, element] : all) {
        if (found.count(key) > 0) continue;
        for (const double a : {-0.5, 0.5})
          for (const double c : {-0.5, 0.5})
            missed += distance(shape, X, element.position + a * element.along + c * element.across) < kTouching ? 1 : 0;
        free[distance(shape, X, element.position)] = element.position;
      }
      // Straight at the nearest, shifting and turning, as far as nothing else touches.
      int tried = 0;
      for (const auto& [d, q] : free) {
        if (++tried > 40) break;
        const Vec3d toward = gradient(shape, X, q), arm = q - X.translation();
        const Vec3d on = random.uniform(0, 3e-3) * toward;
        const Vec3d about = on.norm() * random.uniform(0, 200) * arm.cross(toward).normalized();
        const double share = std::min(1.0, clear.max_step_fraction({on.norm(), about.norm()}));
        shares.add(share);
        constexpr double kRounding = 1e-8;
        missed += distance(shape, moved(X, share * on, share * about), q) < kTouching - kRounding ? 1 : 0;
      }
    }
  }
  MESSAGE("visited ", visits, " elements; cuts ", cuts, "; clear shares of motions ", shares);
  CHECK(missed == 0);
  CHECK(visits > 1000);
  CHECK(cuts > 15);
  CHECK(shares.median() > 0.05);
}

// Points at the middles of elements: then their distances are those of the bounding balls' centres.
TEST_CASE("broad phase: a list of another pose has every element that a small motion brings into contact") {
  CAPTURE(kSeed);
  Random random(kSeed + 2);
  const BallAndShaft shape(kDrill);
  constexpr double kH = 3e-4, kRounding = 1e-8;
  const RasterOptions o{.size = {48, 48, 48}, .spacing = Vec3d::Constant(kH)};
  const Ball ball{o.middle(), 5e-3};
  auto bone = rasterise<std::uint8_t>(ball, o);
  Surface surface(bone, o.isovalue());
  BroadPhase near;
  near.reserve(surface.view(), kTouching);
  const auto all = all_elements(bone, o.isovalue());
  const ToolMotion small{kH / 64, kH / 64 / kDrill.tip_radius};
  int missed = 0, too_far = 0, entered = 0;
  for (int i = 0; i < 300; ++i) {
    // The shaft beside the bone, some way up; it then comes a little nearer.
    const Vec3d n = random.unit(), axis = n.cross(random.unit()).normalized();
    const double height = random.uniform(0.002, 0.018), gap = random.uniform(-2e-5, 2e-5);
    const Posed X = tool_at(ball.centre + (ball.radius + kDrill.shaft_radius + gap) * n - height * axis, axis);
    const Posed Y = moved(X, -small.shift * n, small.turn * n.cross(axis).normalized());
    do surface.begin_tick();
    while (!near.update(surface.view(), shape, X, {}));
    std::set<std::uint64_t> before, after;
    const auto visit = [&](std::set<std::uint64_t>& found) {
      return [&](const NearBlock& block, std::size_t k, const Vec3<float>&) { found.insert(block.key(k)); };
    };
    static_cast<void>(near.elements().for_each_candidate(shape, X, 0, visit(before)));
    const Clearance clear = near.elements().for_each_candidate(shape, Y, 0, visit(after));
    for (const auto& [key, element] : all) {
      const double d = distance(shape, Y, element.position) - kTouching;
      if (after.count(key) == 0) {
        missed += d < -kRounding ? 1 : 0;
        too_far += clear.listed_distance > d + kRounding ? 1 : 0;
      }
      entered += d < 0 && distance(shape, X, element.position) > kTouching ? 1 : 0;
    }
  }
  MESSAGE("entered ", entered);
  CHECK(missed == 0);
  CHECK(too_far == 0);
  CHECK(entered > 100);
}

TEST_CASE("broad phase: a list with bricks that wait for their turn serves its tick, and no other") {
  const RasterOptions o{.size = {90, 60, 50}, .contrast = 100};
  auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d(0.2, 0.1, 1).normalized()}, o);
  Surface surface(grid, o.isovalue());
  const auto view = surface.view();
  const BallAndShaft shape(
      Burr{.tip_radius = 14 * o.spacing[0], .shaft_radius = 6 * o.spacing[0], .shaft_length = 0.02});
  const Posed X = make_pose<double>(Mat3d::Identity(), o.middle());
  const auto cut = [&](double radius) {
    carve(grid, o.isovalue(), SphereCutter(o.middle(), o.middle(), radius * o.spacing[0]), GeometricCut{}, {}, 0);
  };
  constexpr int kTurns = 7;
  BroadPhase near;
  near.reserve(view, kTouching);
  const auto tick = [&](int turn) {
    surface.begin_tick(1 << 20);
    surface.begin_turn({turn, kTurns});
    const bool was_current = near.is_current(view);
    REQUIRE(near.update(view, shape, X, {}));
    CHECK(near.is_current(view));
    return was_current;
  };
  tick(0);
  CHECK(tick(1));
  cut(15);
  int gathers = 0;
  for (int t = 2; t < 2 * kTurns + 2; ++t) gathers += tick(t % kTurns) ? 0 : 1;
  // As long as a brick waits, and not after.
  CHECK(gathers > 2);
  CHECK(gathers <= kTurns + 1);
  CHECK(tick(2));
  // What is cut in the tick itself is seen in it.
  cut(16);
  CHECK(!near.is_current(view));
}

// Nothing but surface: what either tool has near it pushes out what the other had.
TEST_CASE("broad phase: blocks that a full store released are provided again") {
  CAPTURE(kSeed);
  constexpr std::size_t kFewest = 8749;
  Random random(kSeed + 1);
  const BallAndShaft shape(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.006});
  const RasterOptions o{.size = {80, 80, 80}};
  std::vector<std::uint8_t> voxels(80 * 80 * 80);
  for (auto& v : voxels) v = random.uniform() < 0.5 ? 200 : 0;
  const Grid bone({.size = o.size, .spacing = o.spacing, .outside = 0}, voxels);
  const auto all = all_elements(bone, 100);
  REQUIRE(all.size() > 2 * kFewest * ElementBlock::kSize);
  Surface surface(bone, 100, kFewest);
  Turns turns(surface, random, o);
  int visits = 0, others = 0, stale = 0;
  for (int i = 0; i < 200; ++i) {
    const std::uint64_t changes = surface.changes();
    const std::size_t t = turns.go(shape, i);
    stale += surface.changes() != changes ? 1 : 0;
    static_cast<void>(turns.near[t].elements().for_each_candidate(
        shape, turns.X[t], 0.5, [&](const NearBlock& block, std::size_t k, const Vec3<float>&) {
          ++visits;
          const auto here = all.find(block.key(k));
          others += here == all.end() || here->second.position != block.element(k).position ? 1 : 0;
        }));
  }
  MESSAGE("visited ", visits, " elements, ticks in which the surface made blocks ", stale);
  CHECK(others == 0);
  CHECK(visits > 10000);
  CHECK(stale > 50);
}

}  // namespace
