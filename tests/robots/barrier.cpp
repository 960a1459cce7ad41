// SPDX-License-Identifier: MIT
// The barrier against brute force: any twist, any pose, several structures.
#include "structure/phantom.hpp"
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/structure/motion_barrier.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

using namespace trephine;
using namespace trephine::test;

namespace {

const Burr kBurr{.tip_radius = 1e-3, .shaft_radius = 0.6e-3, .shaft_length = 12e-3};

/// Largest displacement of points all over the tool.
double sampled_displacement(const Posed& X, const Posed& Y, Random& random) {
  double most = 0;
  for (int n = 0; n < 100; ++n) {
    const Vec3d u = random.unit();
    const Vec3d on_axis(0, 0, kBurr.shaft_length * random.uniform());
    for (const Vec3d& p : {Vec3d(kBurr.tip_radius * u), Vec3d(on_axis + kBurr.shaft_radius * Vec3d(u.x(), u.y(), 0))})
      most = std::max(most, (Y * p - X * p).norm());
  }
  return most;
}

}  // namespace

TEST_CASE("MotionBarrier: a command never enters the clearance, and leaves it only outward") {
  const LabelledTubes tubes = canals();
  const Posed X_WS = make_pose<double>(rotation_from_vector<double>(Vec3d(0.3, -0.5, 0.2)), Vec3d(0.1, -0.2, 0.05));
  const MotionBarrier barrier(tubes.field(5e-3), X_WS, kBurr);
  const double c = barrier.clearance(), share = 1 - 1e-3 * barrier.options().rate;
  Random random(7);
  int outside = 0, inside = 0, limited = 0, stuck = 0;
  for (int run = 0; run < 300; ++run) {
    const Vec3d p_S = 17e-3 * Vec3d{random.uniform(), random.uniform(), random.uniform()};
    Posed X = compose(X_WS, make_pose<double>(random.rotation(), p_S));
    double d = barrier.distance(X).distance;
    Twist wanted;
    for (int tick = 0; tick < 200; ++tick) {
      if (tick % 40 == 0) wanted = {random.arrow(0, 0.2), random.arrow(0, 10)};
      const AllowedMotion motion = barrier.limit(X, wanted, 1e-3);
      const double next = barrier.distance(motion.X_WT).distance;
      REQUIRE(motion.distance == next);
      REQUIRE(next >= (d >= c ? c + share * (d - c) : d));
      REQUIRE(largest_speed(kBurr, z_axis(X), motion.twist) <= barrier.options().speed * (1 + 1e-9));
      (d >= c ? outside : inside) += 1;
      limited += motion.limited;
      stuck += motion.twist.linear.isZero() && motion.twist.angular.isZero();
      X = motion.X_WT;
      d = next;
    }
  }
  CHECK(outside > 20'000);
  CHECK(inside > 5'000);
  CHECK(limited > 5'000);
  CHECK(stuck < 0.2 * limited);
}

TEST_CASE("MotionBarrier: what cannot reach a structure is not changed, and along a wall it slides") {
  // A wall: everything below z = 4 mm, of a ball's field far larger than the tool.
  LabelledTubes wall{.tubes = {{Vec3d(10e-3, 10e-3, -96e-3), Vec3d(10e-3, 10e-3, -96e-3), 0.1}}, .structure = {0}};
  const MotionBarrier barrier(wall.field(5e-3), Posed::Identity(), kBurr);
  Posed X = Posed::Identity();
  X.translation() = Vec3d(8e-3, 9e-3, 14e-3);
  const Twist slow{Vec3d(0.005, -0.01, -0.015), Vec3d(0.1, 0.2, 0)};
  const AllowedMotion free = barrier.limit(X, slow, 1e-3);
  CHECK_FALSE(free.limited);
  CHECK(free.twist.linear == slow.linear);
  CHECK(free.X_WT.translation() == Vec3d(X.translation() + 1e-3 * slow.linear));

  X.translation().z() = 4e-3 + kBurr.tip_radius + barrier.clearance() + 0.05e-3;
  const double from = X.translation().x();
  for (int tick = 0; tick < 100; ++tick) X = barrier.limit(X, {Vec3d(0.015, 0, -0.02), Vec3d::Zero()}, 1e-3).X_WT;
  CHECK(X.translation().x() - from == near(1.5e-3, 0.05));
  CHECK(barrier.distance(X).distance == within(barrier.clearance(), 0.05e-3));
  // And away from it at once.
  const AllowedMotion away = barrier.limit(X, {Vec3d(0, 0, 0.025), Vec3d::Zero()}, 1e-3);
  CHECK_FALSE(away.limited);
}

TEST_CASE("MotionBarrier: speeds and displacements bound every point of the tool") {
  Random random(8);
  for (int n = 0; n < 300; ++n) {
    const Posed X = make_pose<double>(random.rotation(), random.arrow(0, 0.1));
    const Twist v{random.arrow(0, 0.1), random.arrow(0, 20)};
    const Posed Y = pose_after(X, v, 1e-3);
    const double truth = sampled_displacement(X, Y, random), bound = largest_displacement(kBurr, X, Y);
    CHECK(truth <= bound * (1 + 1e-9));
    CHECK(bound <= truth + 1.1 * kBurr.tip_radius * 20e-3);
    // To the second order of the turn.
    CHECK(truth <= 1e-3 * largest_speed(kBurr, z_axis(X), v) + kBurr.shaft_length * 0.02 * 0.02);
  }
}

TEST_CASE("MotionBarrier: bad input stands still, without memory") {
  const MotionBarrier barrier(canals().field(5e-3), Posed::Identity(), kBurr);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Posed X = Posed::Identity();
  X.translation() = Vec3d(8e-3, 8e-3, 40e-3);
  CHECK(barrier.limit(X, {Vec3d(nan, 0, 0), Vec3d::Zero()}, 1e-3).twist.linear.isZero());
  CHECK(barrier.limit(X, {Vec3d(0, 0, 1e300), Vec3d::Zero()}, 1e-3).twist.linear.norm() <= 0.03 * (1 + 1e-9));
  CHECK(barrier.limit(X, {Vec3d(0, 0, -1), Vec3d::Zero()}, nan).distance > 0);
  Posed bad = X;
  bad.translation().x() = nan;
  CHECK(barrier.limit(bad, {Vec3d(1, 0, 0), Vec3d::Zero()}, 1e-3).structure == -1);
  const Twist still;
  static_assert(noexcept(barrier.limit(X, still, 1e-3)));
  X.translation().z() = 13e-3;
  const auto calls = heap_calls([&] { (void)barrier.limit(X, {Vec3d(0, 0, -1), Vec3d(1, 2, 3)}, 1e-3); });
  CHECK(calls == 0);
  const auto field = canals().field(5e-3);
  check_refused("it needs a StructureField", [&] { MotionBarrier(nullptr, Posed::Identity(), kBurr); });
  check_refused("margin must be", [&] { MotionBarrier(field, Posed::Identity(), kBurr, {.margin = -1e-3}); });
  check_refused("speed must be", [&] { MotionBarrier(field, Posed::Identity(), kBurr, {.speed = nan}); });
  check_refused("lag must be", [&] { MotionBarrier(field, Posed::Identity(), kBurr, {.lag = 1}); });
}
