// SPDX-License-Identifier: MIT
// Bone that cuts must leave: by points of the interpolant, by the shape of the wall, and by volumes of bodies.
#include "support/densities.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/core/units.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kVoxel = 3e-4;
constexpr int kSize = 40;

/// Balls and capsules: a body by its exact signed distance [m].
struct Capsule {
  Vec3d from, to;
  double radius;
  [[nodiscard]] double distance(const Vec3d& p) const {
    const Vec3d along = to - from;
    const double t = std::clamp((p - from).dot(along) / std::max(along.squaredNorm(), 1e-30), 0.0, 1.0);
    return (p - from - t * along).norm() - radius;
  }
};

template <class Density>
VoxelGrid<Density> block(double iso, double contrast, const Vec3d& spacing = Vec3d::Constant(kVoxel)) {
  std::vector<Density> voxels(static_cast<std::size_t>(kSize) * kSize * kSize, static_cast<Density>(iso + contrast));
  return {{.size = {kSize, kSize, kSize}, .spacing = spacing, .outside = iso - contrast}, voxels};
}

/// Bone of lumps: a sum of waves, so that its own surface meets the bodies everywhere.
template <class Density>
VoxelGrid<Density> lumps(double iso, double contrast, unsigned seed, const Vec3d& spacing) {
  Random random(seed);
  struct Wave {
    Vec3d k;
    double phase;
  };
  std::vector<Wave> waves;
  for (int w = 0; w < 6; ++w) {
    const Vec3d k = random.arrow(0.2, 0.9);
    waves.push_back({k, random.uniform(0, 6.3)});
  }
  std::vector<Density> voxels;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        double v = 0.5;
        for (const Wave& w : waves) v += 0.5 * std::sin(w.k.dot(Vec3d(i, j, k)) + w.phase);
        voxels.push_back(static_cast<Density>(iso + contrast * std::clamp(v, -1.0, 1.0)));
      }
  return {{.size = {kSize, kSize, kSize}, .spacing = spacing, .outside = iso - contrast}, voxels};
}

template <class Density>
std::shared_ptr<CutFloor<Density>> floor_of(const VoxelGrid<Density>& grid, double iso,
                                            const std::vector<Capsule>& bodies) {
  auto floor = std::make_shared<CutFloor<Density>>(grid, iso);
  int owner = 0;
  for (const Capsule& body : bodies)
    floor->protect(owner++, {{0, 0, 0}, {kSize - 1, kSize - 1, kSize - 1}},
                   [&](int i, int j, int k) { return body.distance(grid.spacing().cwiseProduct(Vec3d(i, j, k))); });
  floor->seal(grid);
  return floor;
}

Posed pose(Random& random, const Vec3d& extent) {
  const Vec3d p = extent.cwiseProduct(Vec3d{random.uniform(), random.uniform(), random.uniform()});
  return make_pose<double>(random.rotation(), p);
}

/// Points of the bodies' bone that cuts took, of `points` looked at; `depth` is how far inside a point is.
template <class Density>
void cut_and_look(VoxelGrid<Density> grid, double iso, unsigned seed, double contrast) {
  Random random(seed);
  const Vec3d h = grid.spacing();
  const Vec3d extent = (kSize - 1) * h;
  std::vector<Capsule> bodies;
  for (int b = 0; b < 4; ++b) {
    const Vec3d from = extent.cwiseProduct(Vec3d{random.uniform(), random.uniform(), random.uniform()});
    const Vec3d way = random.arrow(0, 0.5 * extent.minCoeff());
    bodies.push_back({from, from + way, random.uniform(0.6, 5) * h.maxCoeff()});
  }
  const auto floor = floor_of(grid, iso, bodies);
  // The floors from their definition, neither rounded nor clamped.
  std::vector<double> floors;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        double c = 1;
        for (const Capsule& body : bodies) c = std::min(c, body.distance(h.cwiseProduct(Vec3d(i, j, k))));
        floors.push_back(iso - auto_slope(grid, iso) / h.maxCoeff() * c);
      }
  const std::vector<Density> before = densities(grid);
  const Burr burr{.tip_radius = 4 * h.maxCoeff(), .shaft_radius = h.maxCoeff(), .shaft_length = 30 * h.maxCoeff()};
  Cutting at_once;
  Cutting at_rate{{.rate = 400 * contrast}};
  Cutting receding{AdvancingCut{.speed = 0.3}};
  Cutting bit{GeometricCut{}, {}, DrillBit{.radius = 2 * h.maxCoeff(), .length = 12 * h.maxCoeff()}};
  Posed X = pose(random, extent);
  std::int64_t allocations = 0;
  const auto carve = [&](auto& milling, const Posed& to) {
    allocations +=
        heap_calls([&] { (void)milling.carve(grid, iso, X, to, burr, {.dt = 1e-3, .force_N = 3}, floor.get()); });
  };
  for (int cut = 0; cut < 1200; ++cut) {
    Posed to = random.below(4) == 0 ? pose(random, extent) : X;
    to.translation() += random.arrow(0, 6) * h.maxCoeff();
    const int which = random.below(4);
    if (which == 0) carve(at_once, to);
    if (which == 1) carve(at_rate, to);
    if (which == 2) carve(receding, to);
    if (which == 3) carve(bit, to);
    X = to;
    if (cut == 600) CHECK(grid.restore() == 0);
  }
  CHECK(allocations == 0);

  const std::vector<Density> after = densities(grid);
  int points = 0, taken = 0, outside = 0, still_there = 0;
  for (int n = 0; n < 200000; ++n) {
    const Vec3d u = (kSize - 1.001) * Vec3d{random.uniform(), random.uniform(), random.uniform()};
    if (interpolated(before, kSize, u) < iso) continue;
    const bool bone = interpolated(after, kSize, u) >= iso;
    if (interpolated(floors, kSize, u) >= iso) {
      ++points;
      taken += bone ? 0 : 1;
    } else {
      ++outside;
      still_there += bone ? 1 : 0;
    }
  }
  CHECK(points > 500);
  CHECK(taken == 0);
  CHECK(still_there < 0.5 * outside);  // the rest was drilled away
}

}  // namespace

TEST_CASE_TEMPLATE("no cut takes any of a body's bone, whatever the policy", Density, std::uint8_t, std::int16_t,
                   float) {
  const double iso = std::is_same_v<Density, std::uint8_t> ? 100 : 300;
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Vec3d spacing = seed % 2 == 0 ? Vec3d(kVoxel, kVoxel, kVoxel) : Vec3d(kVoxel, 1.2 * kVoxel, 2 * kVoxel);
    CAPTURE(seed);
    const double contrast = seed < 2 ? 90 : 12;
    cut_and_look(lumps<Density>(iso, contrast, 40 + seed, spacing), iso, 90 + seed, contrast);
    cut_and_look(block<Density>(iso, contrast, spacing), iso, 70 + seed, contrast);
  }
}

TEST_CASE("the wall that stays is as smooth as a cut") {
  Random random(5);
  std::vector<double> off;
  for (int n = 0; n < 12; ++n) {
    auto grid = block<std::int16_t>(300, 900);
    const Vec3d centre = kVoxel * (Vec3d::Constant(kSize / 2.0) + random.arrow(0, 1));
    const Capsule ball{centre, centre, 8 * kVoxel};
    const auto floor = floor_of(grid, 300, {ball});
    Cutting milling;
    const Burr burr{.tip_radius = 5 * kVoxel};
    // A burr that is pushed into the ball from all sides.
    Posed X = Posed::Identity();
    for (int c = 0; c < 1500; ++c) {
      Posed to = Posed::Identity();
      to.translation() = centre + random.uniform(4, 12) * kVoxel * random.unit();
      (void)milling.carve(grid, 300, to, to, burr, {.dt = 1e-3, .force_N = 3}, floor.get());
      X = to;
    }
    const std::vector<std::int16_t> after = densities(grid);
    for (int ray = 0; ray < 300; ++ray) {
      const Vec3d n_out = random.unit();
      double lo = 4, hi = 12;  // [voxels]
      for (int i = 0; i < 40; ++i) {
        const double r = 0.5 * (lo + hi);
        (interpolated(after, kSize, Vec3d(centre / kVoxel + r * n_out)) >= 300 ? lo : hi) = r;
      }
      off.push_back(lo - 8);
    }
  }
  double squares = 0, worst = 0;
  for (const double d : off) {
    squares += d * d;
    worst = std::max(worst, std::abs(d));
  }
  const double rms = std::sqrt(squares / static_cast<double>(off.size()));
  MESSAGE("wall off the margin: rms " << rms << ", worst " << worst << " voxel");
  documented("labels", "Wall off the veto's margin, rms", rms);
  CHECK(rms < 0.05);
  CHECK(worst < 0.15);
}

TEST_CASE("refused and taken volumes are the bodies', each voxel once") {
  auto grid = block<std::uint8_t>(100, 90);
  const Vec3d a = kVoxel * Vec3d(14, 20, 20), b = kVoxel * Vec3d(27, 20, 20);
  const double radius = 5 * kVoxel;
  auto floor = std::make_shared<CutFloor<std::uint8_t>>(grid, 100);
  const VoxelBox all{{0, 0, 0}, {kSize - 1, kSize - 1, kSize - 1}};
  floor->protect(3, all, [&](int i, int j, int k) { return (kVoxel * Vec3d(i, j, k) - a).norm() - radius; });
  int inside = 0;
  floor->watch(7, all, [&](int i, int j, int k) {
    const bool in = (kVoxel * Vec3d(i, j, k) - b).norm() < radius;
    inside += in ? 1 : 0;
    return in;
  });
  floor->seal(grid);
  Cutting milling;
  const Burr burr{.tip_radius = 30 * kVoxel};
  Posed X = Posed::Identity();
  X.translation() = kVoxel * Vec3d::Constant(20);
  const double ball = 4.0 / 3 * 3.14159265 * std::pow(5 * kVoxel * 1e3, 3);
  for (int pass = 0; pass < 2; ++pass) {
    (void)milling.carve(grid, 100, X, X, burr, {.dt = 1e-3}, floor.get());
    milling.reset();
    CHECK(floor->refused_mm3(3) == near(ball, 0.03));
    CHECK(floor->refused_mm3() == floor->refused_mm3(3));
    CHECK(floor->taken_mm3(7) == near(inside * std::pow(1e3 * kVoxel, 3)));
    CHECK(floor->taken_mm3() == floor->taken_mm3(7));
    CHECK(floor->refused_mm3(7) == 0);
  }
  floor->reset_counts();
  CHECK(floor->refused_mm3() == 0);
  milling.reset();
  (void)milling.carve(grid, 100, X, X, burr, {.dt = 1e-3}, floor.get());
  CHECK(floor->refused_mm3(3) == near(ball, 0.03));
  CHECK(floor->taken_mm3() == 0);  // it is gone
}

TEST_CASE("what is bone again counts no longer as taken, and counts anew when it is cut again") {
  auto grid = block<std::int16_t>(300, 900);
  auto floor = std::make_shared<CutFloor<std::int16_t>>(grid, 300);
  const VoxelBox all{{0, 0, 0}, {kSize - 1, kSize - 1, kSize - 1}};
  floor->watch(7, all, [](int i, int j, int k) { return i < 10 && j < 30 && k < 30; });
  floor->watch(8, all, [](int i, int j, int k) { return i >= 10 && j < 30 && k < 30; });
  Cutting milling;
  const auto cut_at = [&](double i) {
    Posed X = Posed::Identity();
    X.translation() = kVoxel * Vec3d(i, 15, 15);
    (void)milling.carve(grid, 300, X, X, Burr{.tip_radius = 4 * kVoxel}, {.dt = 1e-3}, floor.get());
    milling.reset();
  };
  cut_at(9.5);
  const double left = floor->taken_mm3(7), right = floor->taken_mm3(8);
  CHECK(left > 0);
  CHECK(right > 0);
  floor->forget_put_back(grid);  // nothing was
  CHECK(floor->taken_mm3(7) == left);
  grid.restore();
  floor->forget_put_back(grid);
  CHECK(floor->taken_mm3(7) == 0);
  CHECK(floor->taken_mm3() == 0);
  cut_at(9.5);
  CHECK(floor->taken_mm3(7) == left);
  CHECK(floor->taken_mm3(8) == right);
  CHECK(floor->taken_mm3() == near(left + right));
}

TEST_CASE("one floor protects a body and watches its neighbour, whichever was named first") {
  // Two balls that overlap: what of the watched lies outside of the protected may be taken, and is counted.
  const Vec3d a = kVoxel * Vec3d(17, 20, 20), b = kVoxel * Vec3d(23, 20, 20);
  const double radius = 5 * kVoxel;
  const VoxelBox all{{0, 0, 0}, {kSize - 1, kSize - 1, kSize - 1}};
  const auto place = [](int i, int j, int k) { return Vec3d(kVoxel * Vec3d(i, j, k)); };
  const auto keep = [&](CutFloor<std::int16_t>& f) {
    f.protect(0, all, [&](int i, int j, int k) { return (place(i, j, k) - a).norm() - radius; });
  };
  const auto watch = [&](CutFloor<std::int16_t>& f) {
    f.watch(1, all, [&](int i, int j, int k) { return (place(i, j, k) - b).norm() < radius; });
  };
  for (const bool watched_first : {false, true}) {
    CAPTURE(watched_first);
    auto grid = block<std::int16_t>(300, 900);
    const auto floor = std::make_shared<CutFloor<std::int16_t>>(grid, 300);
    if (watched_first) watch(*floor);
    keep(*floor);
    if (!watched_first) watch(*floor);
    floor->seal(grid);
    const std::vector<std::int16_t> before = densities(grid);
    Cutting milling;
    Posed X = Posed::Identity();
    X.translation() = kVoxel * Vec3d::Constant(20);
    (void)milling.carve(grid, 300, X, X, Burr{.tip_radius = 30 * kVoxel}, {.dt = 1e-3}, floor.get());
    const std::vector<std::int16_t> after = densities(grid);
    int gone_a = 0, gone_b = 0, whole_a = 0, whole_b = 0;
    std::size_t at = 0;
    for (int k = 0; k < kSize; ++k)
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i, ++at) {
          if (before[at] < 300) continue;
          const bool in_a = floor->is_protected(i, j, k), in_b = (place(i, j, k) - b).norm() < radius;
          (in_a ? whole_a : whole_b) += in_a || in_b ? 1 : 0;
          if (after[at] < 300) (in_a ? gone_a : gone_b) += in_a || in_b ? 1 : 0;
        }
    const double voxel = std::pow(1e3 * kVoxel, 3);
    CHECK(gone_a == 0);
    CHECK(gone_b == whole_b);
    CHECK(floor->refused_mm3(0) == near(voxel * whole_a));
    CHECK(floor->refused_mm3() == floor->refused_mm3(0));
    CHECK(floor->taken_mm3(1) == near(voxel * gone_b));
    CHECK(floor->taken_mm3() == floor->taken_mm3(1));
    CHECK(floor->counts().refused == static_cast<std::uint64_t>(whole_a));
    CHECK(floor->counts().taken == static_cast<std::uint64_t>(gone_b));
  }
}

TEST_CASE("a floor of another bone or isovalue cuts nothing, and is refused by a scene") {
  auto grid = block<std::uint8_t>(100, 90);
  const auto floor = floor_of(grid, 100, {});
  const GeometricCut at_once;
  const ProtectedCut cut(at_once, *floor);
  const Veto veto{floor};
  const SphereCutter ball(kVoxel * Vec3d::Constant(20), kVoxel * Vec3d::Constant(20), 5 * kVoxel);
  CHECK(carve(grid, 99, ball, cut) == 0);
  std::vector<std::uint8_t> few(8 * 8 * 8, 190);
  VoxelGrid<std::uint8_t> other({.size = {8, 8, 8}, .spacing = Vec3d::Constant(kVoxel), .outside = 0}, few);
  CHECK(carve(other, 100, SphereCutter(Vec3d::Zero(), Vec3d::Zero(), 5 * kVoxel), cut) == 0);
  CHECK_THROWS_AS(veto.validate_for(grid, 99), std::invalid_argument);
  CHECK_THROWS_AS(veto.validate_for(other, 100), std::invalid_argument);
  CHECK(carve(grid, 100, ball, cut) > 0);
  CHECK_THROWS_AS(Veto(std::shared_ptr<CutFloor<std::uint8_t>>()), std::invalid_argument);
}

TEST_CASE("a floor without bodies changes no bit of a cut") {
  auto plain = lumps<std::int16_t>(300, 900, 3, Vec3d::Constant(kVoxel));
  auto guarded = lumps<std::int16_t>(300, 900, 3, Vec3d::Constant(kVoxel));
  const auto floor = floor_of(guarded, 300, {});
  Random random(8);
  for (int n = 0; n < 200; ++n) {
    const Vec3d p = kVoxel * kSize * Vec3d{random.uniform(), random.uniform(), random.uniform()};
    const SphereCutter ball(p, p, 4 * kVoxel);
    const CutAllowance allowance{.dt = 1e-3, .force_N = 2, .tick = static_cast<std::uint32_t>(n)};
    const AdvancingCut advancing{.speed = 0.1};
    CHECK(carve(plain, 300, ball, advancing, allowance) ==
          carve(guarded, 300, ball, ProtectedCut(advancing, *floor), allowance));
  }
  CHECK(densities(plain) == densities(guarded));
}
