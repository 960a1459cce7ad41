// SPDX-License-Identifier: MIT
#include "pick_places.hpp"
#include "support/near.hpp"
#include "volumes.hpp"

#include <doctest/doctest.h>

using trephine::test::near;

using namespace pick;
using namespace pick::test;
using trephine::Posed;
using trephine::Vec3d;

namespace {

constexpr double kStep = 1.5e-4;                     // of the search for the touch
constexpr double kTolerance = 0.004 * kStep + 5e-7;  // its last halving, and the rounding of densities

}  // namespace

TEST_CASE("a motion's touch is where the closed form has it: straight onto a plane") {
  const Grid grid = plane(0.010);
  const Field field(grid, kIsovalue);
  for (const double tilt : {0.0, 0.3, 0.8}) {
    const Vec3d shaft(std::sin(tilt), 0, std::cos(tilt));
    const Motion down{tool_pose({0.008, 0.015, 0.014}, shaft), -Vec3d::UnitZ(), Vec3d::Zero()};
    Feeler line(Algorithm::kLine, kBurr, 2e-4);
    Feeler surface(Algorithm::kSurface, kBurr, 2e-4);
    CHECK(*find_touch(line, field, down, 0.02, kStep) == near(0.004, kTolerance / 0.004));
    // Between the feeler's points the ball reaches a little farther: spacing squared over two radii at most.
    const double touch = *find_touch(surface, field, down, 0.02, kStep);
    CHECK(touch >= 0.004 - kBurr.tip_radius - kTolerance);
    CHECK(touch <= 0.004 - kBurr.tip_radius + 4e-8 / (2 * kBurr.tip_radius) + kTolerance);
  }
}

TEST_CASE("a motion's touch is where the closed form has it: turned about the tip") {
  const Grid grid = plane(0.010);
  const Field field(grid, kIsovalue);
  const double above = 0.002;
  const double height = 0.011;
  Feeler line(Algorithm::kLine, kBurr, 2e-4);
  const Motion turn{tool_pose({0.005, 0.015, 0.010 + above}, Vec3d::UnitX()), Vec3d::Zero(),
                    turn_toward(Vec3d::UnitX(), -Vec3d::UnitZ(), height)};
  // The far end meets the plane first, after asin(above / length); s is the way along the arc at `height`.
  const double expected = height * std::asin(above / kBurr.shaft_length);
  CHECK(*find_touch(line, field, turn, 0.02, kStep) == near(expected, kTolerance / expected));
  const Vec3d moved = turn.at(1e-6) * Vec3d(0, 0, height) - turn.at(0) * Vec3d(0, 0, height);
  CHECK((moved - Vec3d(0, 0, -1e-6)).norm() < 1.4e-10);
}

TEST_CASE("no touch: in bone from the start, or out of reach") {
  const Grid grid = plane(0.010);
  const Field field(grid, kIsovalue);
  Feeler surface(Algorithm::kSurface, kBurr, 2e-4);
  const Motion within{tool_pose({0.015, 0.015, 0.011}, Vec3d::UnitZ()), -Vec3d::UnitZ(), Vec3d::Zero()};
  CHECK_FALSE(find_touch(surface, field, within, 0.02, kStep));
  const Motion away{tool_pose({0.015, 0.015, 0.014}, Vec3d::UnitZ()), Vec3d::UnitZ(), Vec3d::Zero()};
  CHECK_FALSE(find_touch(surface, field, away, 0.01, kStep));
}

TEST_CASE("press and slide: from the gap to the depth, then along") {
  const Motion down{tool_pose({0, 0, 0.01}, Vec3d::UnitZ()), -Vec3d::UnitZ(), Vec3d::Zero()};
  std::vector<Posed> X;
  press(down, 0.004, 0.0003, 0.001, 11, X);
  REQUIRE(X.size() == 13);
  CHECK(X.front().translation().z() == near(0.0063));
  CHECK(X[10].translation().z() == near(0.005));
  CHECK(X[12].translation() == X[10].translation());
  for (std::size_t i = 1; i < 11; ++i) CHECK(X[i - 1].translation().z() - X[i].translation().z() == near(0.00013));
  slide({1e-4, 0, 0}, 4, X);
  REQUIRE(X.size() == 17);
  CHECK((X.back().translation() - Vec3d(4e-4, 0, 0.005)).norm() < 1e-12);
}

TEST_CASE("spots lie on a ball's surface, point outward and repeat with the seed") {
  const double radius = 0.008;
  const Grid grid = ball(radius);
  const Field field(grid, kIsovalue);
  const Vec3d middle = Vec3d::Constant(0.5 * 5e-4 * 59);
  Random random(5), again(5);
  int found = 0;
  Vec3d mean = Vec3d::Zero();
  for (int i = 0; i < 4000; ++i) {
    const auto spot = random_spot(field, random);
    const auto same = random_spot(field, again);
    CHECK(spot.has_value() == same.has_value());
    if (!spot) continue;
    ++found;
    CHECK(spot->p == same->p);
    const Vec3d out = spot->p - middle;
    CHECK(std::abs(out.norm() - radius) < 0.05 * 5e-4);  // the trilinear interpolant's own error
    CHECK(spot->n.dot(out.normalized()) > std::cos(0.06));
    mean += out / radius;
  }
  REQUIRE(found > 300);
  // Evenly round the ball: the mean of n unit vectors is about 1/sqrt(n).
  CHECK((mean / found).norm() < 4 / std::sqrt(found));
}

TEST_CASE("crests: a cylinder is one across its axis and none along it") {
  const double radius = 0.003;
  const Grid grid = rasterise({50, 50, 50}, Vec3d::Constant(3e-4),
                              [&](const Vec3d& p) { return std::hypot(p.x() - 0.0075, p.z() - 0.0075) - radius; });
  const Field field(grid, kIsovalue);
  const Spot top{{0.0075, 0.0075, 0.0105}, Vec3d::UnitZ()};
  // It falls by w²/2r at w across: by .3 w from w = .6 r on.
  CHECK(is_crest(field, top, Vec3d::UnitX(), 0.75 * radius));
  CHECK_FALSE(is_crest(field, top, Vec3d::UnitX(), 0.4 * radius));
  CHECK_FALSE(is_crest(field, top, Vec3d::UnitY(), 0.75 * radius));
}

TEST_CASE("cases: of every kind, free at first, in contact at last, repeatable") {
  const Grid bone = knuckle();
  const Field field(bone, kIsovalue);
  const CaseOptions options{.per_kind = 12, .deepest = 8e-4, .seed = 7};
  for (const Algorithm algorithm : {Algorithm::kLine, Algorithm::kSurface}) {
    CAPTURE(name_of(algorithm));
    const auto cases = make_cases(field, kBurr, algorithm, options);
    for (const int n : count_kinds(cases)) CHECK(n == options.per_kind);
    Feeler feeler(algorithm, kBurr, 1.4e-4);
    for (const Case& c : cases) {
      CHECK_FALSE(feeler.touches(field, c.X_GT.front()));
      if (c.kind != Kind::kSlide) CHECK(feeler.touches(field, c.X_GT.back()));
      // No farther in a tick than a hand moves in a millisecond.
      for (std::size_t i = 1; i < c.X_GT.size(); ++i)
        CHECK((c.X_GT[i].translation() - c.X_GT[i - 1].translation()).norm() < 2e-4);
    }
    // The same from the same seed.
    const auto same = make_cases(field, kBurr, algorithm, options);
    REQUIRE(same.size() == cases.size());
    for (std::size_t i = 0; i < same.size(); ++i) CHECK(same[i].X_GT.back().matrix() == cases[i].X_GT.back().matrix());
  }
}
