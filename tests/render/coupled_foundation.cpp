// SPDX-License-Identifier: MIT
#include "render/all_elements.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/poses.hpp"
#include "support/profile.hpp"
#include "support/raster.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/tool/ball_and_shaft.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 303;
constexpr double kH = 3e-4;
// A newton or so at a tenth of a millimetre.
constexpr FoundationLaw kLaw{.stiffness = 1e10, .ramp = 3e-5, .offset = 5e-6};
constexpr double kArm = 0.01;  // [m]: turns count as what they move at this distance
constexpr Burr kBall{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0};
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};

/// A ball as any part is: without the short cut for forces through T's origin.
struct General : BallAndShaft {
  using BallAndShaft::BallAndShaft;
  void profile(const ProfileLanes<double>& rho, const ProfileLanes<double>& z, Profile& out) const noexcept {
    BallAndShaft::profile(rho, z, out);
    out.central.fill(0);
  }
};
static_assert(ToolShape<General>);

const RasterOptions kRoom{.size = {56, 56, 56}, .contrast = 2000, .air = -1000};
const Ball kBone{kRoom.middle(), 20 * kH};

/// A bone, its surface, and what is near a tool.
struct Bench {
  VoxelGrid<std::int16_t> bone;
  BoneSurface<std::int16_t> surface{bone, kRoom.isovalue()};
  BroadPhase near;

  template <class Shape>
  explicit Bench(const Shape& shape) : bone(rasterise<std::int16_t>(shape, kRoom)) {}

  template <class Shape>
  void gather(const Shape& shape, const Posed& X) {
    near.reserve(surface.view(), kLaw.offset);
    surface.begin_tick();
    while (!near.update(surface.view(), shape, X, {6 * kH, 0})) surface.begin_tick();
  }

  /// A pose whose ball, or whose shaft, is from `least` to `most` deep in the bone.
  Posed pressed(Random& random, bool lying, double least, double most) const {
    const double deep = random.uniform(least, most);
    const Vec3d n = random.unit(), other = random.unit();
    if (!lying)
      return tool_at(kRoom.middle() + (kBone.radius + kDrill.tip_radius - deep) * n, (n + 0.5 * other).normalized());
    const Vec3d axis = n.cross(other).normalized();
    return tool_at(
        kRoom.middle() + (kBone.radius + kDrill.shaft_radius - deep) * n - random.uniform(0.004, 0.012) * axis, axis);
  }
};

Posed moved(const Posed& X, const Vec6d& twist, double by) {
  const Vec6d step = by * twist;
  return make_pose<double>(rotation_from_vector(Vec3d(step.tail<3>())) * X.linear(), X.translation() + step.head<3>());
}

Vec6d random_twist(Random& random) {
  Vec6d t;
  const double share = random.uniform();
  const Vec3d turn = random.unit();
  t << share * turn, (1 - share) / kArm * random.unit();
  return t;
}

/// Length of a wrench, and of a stiffness, in terms of such twists.
double size_of(const Vec6d& w) { return w.head<3>().norm() + w.tail<3>().norm() / kArm; }
double size_of(Mat6d H) {
  H.bottomRows<3>() /= kArm;
  H.rightCols<3>() /= kArm;
  return H.norm();
}

/// The energy's second derivative: the sum stores its lower triangle.
Mat6d second_derivative(const FoundationSum& s) {
  const Mat6d lower = s.stiffness + s.geometric_stiffness;
  return lower.selfadjointView<Eigen::Lower>();
}

/// Whether what is nearest to the arm is the ball about the tool's origin.
bool is_central(const BallAndShaft& shape, const Posed& X, const Vec3d& arm) {
  const Vec3d in_T = X.linear().transpose() * arm;
  return profile_at(shape, in_T.head<2>().norm(), in_T.z()).central;
}

struct Slopes {
  Figures first, second;
  int entered = 0;  // where points come in between, the second derivative jumps
  int touching = 0;
};

/// Differences along random twists. A twist goes on about the same axis, so that along it the energy's derivative is
/// −wrench · twist everywhere, and its second one the difference of these.
template <class Shape>
void differentiate(Bench& bench, const Shape& shape, const Posed& X, Random& random, Slopes& slopes) {
  constexpr double kStep = 1e-8;  // [m]: rounding of 1e-15 of a newton over it is 1e-7 N/m
  bench.gather(shape, X);
  Foundation foundation(2, 16384);
  const FoundationSum at = foundation.sum(bench.near.elements(), shape, X, kLaw);
  const std::size_t count = foundation.points().size();
  slopes.touching += count > 12 ? 1 : 0;
  const Mat6d H = second_derivative(at);
  for (int i = 0; i < 12; ++i) {
    const Vec6d twist = random_twist(random);
    const FoundationSum a = foundation.sum(bench.near.elements(), shape, moved(X, twist, -kStep), kLaw);
    const std::size_t before = foundation.points().size();
    const FoundationSum b = foundation.sum(bench.near.elements(), shape, moved(X, twist, kStep), kLaw);
    slopes.first.add(std::abs((b.energy - a.energy) / (2 * kStep) + at.wrench.dot(twist)) / size_of(at.wrench));
    if (before != count || foundation.points().size() != count) {
      ++slopes.entered;
      continue;
    }
    slopes.second.add(std::abs((a.wrench - b.wrench).dot(twist) / (2 * kStep) - twist.dot(H * twist)) / size_of(H));
  }
}

// Central differences over 1e-8 m leave roundings of 1e-8 of a newton, and of 1e-7 of the stiffness; a point at the
// crease between ball and shaft may be on either side of it.
TEST_CASE("foundation: the wrench is the energy's slope, stiffness and geometric stiffness its second derivative") {
  CAPTURE(kSeed);
  constexpr double kFirstError = 6e-8, kSecondError = 1.7e-7;
  Bench bench(kBone);
  struct Case {
    const char* name;
    Burr burr;
    bool lying;
    double least, most;
  };
  for (const Case& c :
       {Case{"ball, shallow", kBall, false, 6e-5, 2e-4}, Case{"ball, deep", kBall, false, 4e-4, 1e-3},
        Case{"drill's ball", kDrill, false, 2e-5, 1e-3}, Case{"shaft, shallow", kDrill, true, 2e-5, 2e-4},
        Case{"shaft, deep", kDrill, true, 3e-4, 6e-4}}) {
    Random random(kSeed);
    Slopes slopes;
    for (int i = 0; i < 25; ++i)
      differentiate(bench, BallAndShaft(c.burr), bench.pressed(random, c.lying, c.least, c.most), random, slopes);
    MESSAGE(std::string(c.name), ": first derivative off by ", slopes.first, ", second by ", slopes.second,
            "; left out ", slopes.entered);
    CHECK(slopes.touching == 25);
    CHECK(slopes.second.count() > 200);
    CHECK(slopes.first.worst() <= kFirstError);
    CHECK(slopes.second.worst() <= kSecondError);
  }
}

// Ball and shaft at once: the drill lies across the rim of a hole that its ball is in.
TEST_CASE("foundation: derivatives with ball and shaft in contact") {
  CAPTURE(kSeed);
  constexpr double kFirstError = 5e-8, kSecondError = 1e-6;
  const Vec3d m = kRoom.middle();
  Bench bench(Either{HalfSpace{m, Vec3d::UnitZ()}, Block{m + Vec3d(0.003, 0, 0.001), Vec3d(0.001, 0.009, 0.001)}});
  Random random(kSeed + 1);
  Slopes slopes;
  int both = 0;
  for (int i = 0; i < 25; ++i) {
    const Vec3d axis = Vec3d{1, random.uniform(-0.3, 0.3), random.uniform(0.12, 0.2)}.normalized();
    const double deep = random.uniform(1e-4, 6e-4);
    const Posed X = tool_at(m + Vec3d(-0.002, 0, 0.0015 - deep), axis, random.uniform(0, 6));
    const BallAndShaft shape(kDrill);
    differentiate(bench, shape, X, random, slopes);
    Foundation foundation(2, 16384);
    static_cast<void>(foundation.sum(bench.near.elements(), shape, X, kLaw));
    int central = 0;
    for (const FoundationPoint& p : foundation.points()) central += is_central(shape, X, p.arm) ? 1 : 0;
    both += central > 10 && static_cast<std::size_t>(central) + 10 < foundation.points().size() ? 1 : 0;
  }
  MESSAGE("ball and shaft: first derivative off by ", slopes.first, ", second by ", slopes.second, "; left out ",
          slopes.entered);
  CHECK(both > 15);
  CHECK(slopes.first.worst() <= kFirstError);
  CHECK(slopes.second.worst() <= kSecondError);
}

TEST_CASE("foundation: forces through T's origin add up as any others do") {
  CAPTURE(kSeed);
  constexpr double kRounding = 3e-15;
  Bench bench(kBone);
  Random random(kSeed + 2);
  Figures off;
  for (int i = 0; i < 40; ++i) {
    const Posed X = bench.pressed(random, false, 2e-5, 1e-3);
    const BallAndShaft fast(kBall);
    const General general(kBall);
    bench.gather(fast, X);
    Foundation a(2, 16384), b(2, 16384);
    const FoundationSum f = a.sum(bench.near.elements(), fast, X, kLaw),
                        g = b.sum(bench.near.elements(), general, X, kLaw);
    REQUIRE(a.points().size() == b.points().size());
    REQUIRE(a.points().size() > 20);
    CHECK(f.wrench.tail<3>() == Vec3d::Zero());
    off.add(std::abs(f.energy - g.energy) / f.energy);
    off.add(size_of(Vec6d(f.wrench - g.wrench)) / size_of(f.wrench));
    const Mat6d Hf = second_derivative(f), Hg = second_derivative(g);
    off.add(size_of(Mat6d(Hf - Hg)) / size_of(Hf));
    CHECK(f.depth == g.depth);
    CHECK(f.clearance.listed_distance == g.clearance.listed_distance);
  }
  MESSAGE("central against general: ", off);
  CHECK(off.worst() <= kRounding);
}

TEST_CASE("foundation: the sum is its points', as many as there is room for, and takes no memory") {
  CAPTURE(kSeed);
  constexpr double kRounding = 4e-15;
  Bench bench(kBone);
  Random random(kSeed + 3);
  const BallAndShaft shape(kDrill);
  for (const bool lying : {false, true}) {
    const Posed X = bench.pressed(random, lying, 5e-4, 5e-4);
    bench.gather(shape, X);
    Foundation all(2, 16384), few(2, 100);
    FoundationSum s;
    CHECK(heap_calls([&] { s = all.sum(bench.near.elements(), shape, X, kLaw); }) == 0);
    double energy = 0, deepest = 0;
    Vec6d wrench = Vec6d::Zero();
    for (const FoundationPoint& p : all.points()) {
      // The mean of max(u − s, 0) over 0 <= s <= ramp, and of half its square.
      const double u = p.depth_slope < 1 - kRounding ? p.depth_slope * kLaw.ramp : p.depth + kLaw.ramp / 2;
      const double v = std::max(u - kLaw.ramp, 0.0);
      CHECK(p.depth == near((u * u - v * v) / (2 * kLaw.ramp)));
      energy += kLaw.stiffness * p.weight * (u * u * u - v * v * v) / (6 * kLaw.ramp);
      deepest = std::max(deepest, u - kLaw.offset);
      wrench -= kLaw.stiffness * p.weight * p.depth * with_moment(p.normal, p.arm);
    }
    CHECK(std::abs(s.energy - energy) <= kRounding * energy);
    CHECK(size_of(Vec6d(s.wrench - wrench)) <= kRounding * size_of(wrench));
    CHECK(s.depth == near(deepest));
    REQUIRE(all.points().size() > 100);
    CHECK(heap_calls([&] { s = few.sum(bench.near.elements(), shape, X, kLaw); }) == 0);
    CHECK(few.points().size() == 100);
    all.clear();
    CHECK(all.points().empty());
  }
}

// A list gathered elsewhere is kept while the tool is within its reach. Its sum equals that of a list gathered in
// place.
TEST_CASE("foundation: a list within reach of the tool has the same sum, and its clearance is free") {
  CAPTURE(kSeed);
  constexpr double kRounding = 1e-6;  // the list's places are single precision, to find what may touch
  Bench bench(kBone), anew(kBone);
  Random random(kSeed + 4);
  int kept = 0;
  Figures off, over, shares;
  const ToolMotion reach{CoupledConstants::kMaxReach * kH, CoupledConstants::kMinReachAngle};
  const auto compare = [&](const auto& shape, const Posed& start) {
    bench.gather(shape, start);
    Posed gathered = start;
    for (int i = 0; i < 40; ++i) {
      const Vec6d twist = random_twist(random);
      const Posed X = moved(start, twist, random.uniform(0, 2e-3));
      bench.surface.begin_tick();
      REQUIRE(bench.near.update(bench.surface.view(), shape, X, {6 * kH, 0}));
      if (motion_between(gathered, X).is_within(reach))
        ++kept;
      else
        gathered = X;
      anew.gather(shape, X);
      Foundation a(2, 16384), b(2, 16384);
      const FoundationSum s = a.sum(bench.near.elements(), shape, X, kLaw),
                          t = b.sum(anew.near.elements(), shape, X, kLaw);
      CHECK(a.points().size() == b.points().size());
      if (t.energy > 0) off.add(size_of(Vec6d(s.wrench - t.wrench)) / size_of(t.wrench));
      // A motion by less than the clearance brings no more points, whichever way it goes.
      if (t.energy > 0 || !(s.clearance.listed_distance > 0)) continue;
      const Vec3d in = (kRoom.middle() - X.translation()).normalized();
      Vec6d step;
      step << 2e-3 * in, random.uniform(0, 0.2) * X.linear().col(2).cross(in);
      double share = 1;
      while (s.clearance.max_step_fraction(motion_between(X, moved(X, step, share))) < 1) share *= 0.9;
      const Posed ahead = moved(X, step, share);
      anew.gather(shape, ahead);
      over.add(b.sum(anew.near.elements(), shape, ahead, kLaw).energy);
      shares.add(share);
    }
  };
  for (int i = 0; i < 6; ++i) {
    compare(BallAndShaft(kBall), bench.pressed(random, false, -1e-3, 5e-4));
    compare(BallAndShaft(kDrill), bench.pressed(random, true, -1e-3, 5e-4));
  }
  MESSAGE("list from elsewhere against one at the place: ", off, "; kept ", kept, "; free places ", over,
          ", by shares of a motion ", shares);
  CHECK(kept > 50);
  CHECK(over.count() > 20);
  CHECK(off.worst() <= kRounding);
  CHECK(over.worst() == 0);
  CHECK(shares.median() > 0.05);
}

/// Least distance of an element's points from contact [m], over the elements that are free.
double least_free_distance(const std::map<std::uint64_t, SurfaceElement>& elements, const BallAndShaft& shape,
                           const Posed& X) {
  double least = 1;
  for (const auto& [key, element] : elements) {
    double nearest = 1;
    for (const double a : {-0.5, 0.5})
      for (const double c : {-0.5, 0.5}) {
        const Vec3d in_T = X.inverse() * (element.position + a * element.along + c * element.across);
        nearest = std::min(nearest, profile_at(shape, in_T.head<2>().norm(), in_T.z()).distance - kLaw.offset);
      }
    if (nearest > 0) least = std::min(least, nearest);
  }
  return least;
}

// Lists made at another pose serve a path of small and large motions, against those made in place.
TEST_CASE("foundation: sums by a list of another pose are those by a new one, bit by bit, with a clearance below") {
  CAPTURE(kSeed);
  Bench bench(kBone), anew(kBone);
  const auto elements = all_elements(bench.bone, kRoom.isovalue());
  Random random(kSeed + 5);
  int small = 0, points = 0;
  Figures clearances;
  Foundation a(2, 16384), b(2, 16384);
  const ToolMotion near{kH / 64, kH / 64 / kDrill.tip_radius};
  const auto follow = [&](const auto& shape, Posed X) {
    bench.gather(shape, X);
    for (int i = 0; i < 200; ++i) {
      const Posed last = X;
      X = moved(X, random_twist(random), random.uniform() < 0.1 ? 3e-4 : random.uniform(0, 1e-5));
      bench.surface.begin_tick();
      REQUIRE(bench.near.update(bench.surface.view(), shape, X, {6 * kH, 0}));
      small += motion_between(last, X).is_within(near) ? 1 : 0;
      anew.gather(shape, X);
      const FoundationSum s = a.sum(bench.near.elements(), shape, X, kLaw),
                          t = b.sum(anew.near.elements(), shape, X, kLaw);
      CHECK(s.energy == t.energy);
      CHECK(s.wrench == t.wrench);
      CHECK(s.stiffness == t.stiffness);
      CHECK(s.depth == t.depth);
      REQUIRE(a.points().size() == b.points().size());
      points += static_cast<int>(a.points().size());
      if (i % 20 != 0) continue;
      const double least = least_free_distance(elements, shape, X);
      constexpr double kRounding = 1e-8;
      CHECK(s.clearance.listed_distance <= least + kRounding);
      if (least < 1e-3) clearances.add(s.clearance.listed_distance / least);
    }
  };
  for (int i = 0; i < 4; ++i) {
    follow(BallAndShaft(kBall), bench.pressed(random, false, -1e-4, 3e-4));
    follow(BallAndShaft(kDrill), bench.pressed(random, true, -1e-4, 3e-4));
  }
  // Straight into bone by a small motion.
  int entered = 0;
  for (int i = 0; i < 240; ++i) {
    const BallAndShaft shape(kDrill);
    const bool is_free = i % 6 == 0;
    const Posed X = bench.pressed(random, true, is_free ? -3e-4 : -1e-4, is_free ? -1e-4 : 2e-5);
    bench.gather(shape, X);
    const Vec3d u = X.linear().col(2), arrow = kRoom.middle() - X.translation(),
                in = (arrow - arrow.dot(u) * u).normalized();
    Vec6d way;
    way << near.shift * in, near.turn * u.cross(in);
    const Posed Y = moved(X, way, 1);
    static_cast<void>(a.sum(bench.near.elements(), shape, X, kLaw));
    const std::size_t before = a.points().size();
    anew.gather(shape, Y);
    const FoundationSum s = a.sum(bench.near.elements(), shape, Y, kLaw),
                        t = b.sum(anew.near.elements(), shape, Y, kLaw);
    CHECK(s.energy == t.energy);
    if (is_free) CHECK(s.clearance.listed_distance <= least_free_distance(elements, shape, Y) + 1e-8);
    REQUIRE(a.points().size() == b.points().size());
    entered += b.points().size() > before ? 1 : 0;
  }
  CHECK(entered > 30);
  MESSAGE("points ", points, "; small motions ", small, "; clearance told, as a share of the true one: ", clearances);
  CHECK(points > 10000);
  CHECK(small > 1000);
  CHECK(clearances.median() > 0.2);
}

}  // namespace
