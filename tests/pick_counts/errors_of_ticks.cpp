// SPDX-License-Identifier: MIT
#include "pick_study.hpp"

#include "pick_places.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <vector>

using trephine::test::near;

using namespace pick;

namespace {

Wrenchd wrench(const Vec3d& force, const Vec3d& torque) { return {force, torque}; }

}  // namespace

TEST_CASE("errors: denominators, directions and what is left out") {
  CHECK(relative_error({2, 0, 0}, {2, 0.1, 0}, kMinForce) == near(0.05));
  CHECK(relative_error({0.01, 0, 0}, {0.02, 0, 0}, 0.05) == near(0.2));
  CHECK(angle_deg({1, 0, 0}, {1, 1, 0}) == near(45));
  CHECK(angle_deg({1, 0, 0}, {-3, 0, 0}) == near(180));
  CHECK(angle_deg({1, 0, 0}, {0, 0, 0}) == 180);

  const std::vector<Wrenchd> truth{wrench({1, 0, 0}, {0, 0.01, 0}), wrench({0, 2, 0}, {0, 0, 0}),
                                   wrench({0.04, 0, 0}, {0, 0, 0}), wrench({5, 0, 0}, {1, 1, 1})};
  const std::vector<Wrenchd> got{wrench({1.1, 0, 0}, {0, 0.0105, 0}), wrench({0, 0, 0}, {0, 0, 0.0005}),
                                 wrench({0, 0, 0}, {0, 0, 0}), wrench({0, 0, 9}, {0, 0, 0})};
  const std::vector<std::uint8_t> counts{1, 1, 1, 0};
  const Errors e = compare(truth, got, counts);
  CHECK(e.samples == 3);
  CHECK(e.directions == 2);
  CHECK(e.misses == 1);
  CHECK(e.excluded() == near(1.0 / 3));
  CHECK(e.force_p50 == near(0.8));  // of .1, 1 and .04/.05
  CHECK(e.force_p95 == near(1));
  CHECK(e.direction_p99 == 180);
  CHECK(e.torque_p95 == near(0.5));  // .0005 over the least torque
  const Limits limits;
  CHECK(limits.worst_share(e) == near(36));  // the direction's 180 of 5 degrees
}

TEST_CASE("ticks that count") {
  const Vec3d none = Vec3d::Zero();
  const std::vector<Wrenchd> truth{wrench(none, none),        wrench({1, 0, 0}, none), wrench({4, 0, 0}, none),
                                   wrench({1, 0, 0}, none),   wrench(none, none),      wrench({1, 0, 0}, {0.2, 0, 0}),
                                   wrench({0.01, 0, 0}, none)};
  const std::vector<Wrenchd> check{wrench(none, none),
                                   wrench({1.01, 0, 0}, none),
                                   wrench({4, 0, 0}, none),
                                   wrench({1, 0.2, 0}, none),
                                   wrench({1, 0, 0}, none),
                                   wrench({1, 0, 0}, {0.2, 0, 0}),
                                   wrench({0, 0.001, 0.0099}, none)};
  const Ticks t = sort_ticks(truth, check, {.force = 0.3, .direction_deg = 5, .torque = 0.06}, 3.3, 0.1);
  CHECK(t.counts == std::vector<std::uint8_t>{0, 1, 0, 0, 0, 0, 1});
  CHECK(t.free == 1);
  CHECK(t.beyond == 2);
  CHECK(t.undecided == 2);  // by direction; by a contact that only one of them has
  CHECK(t.used == 2);
  CHECK(t.undecided_share() == near(0.5));
}

TEST_CASE("random directions are unit vectors, evenly over their cap") {
  Random random(11);
  const Vec3d axis = Vec3d(1, -2, 0.5).normalized();
  double mean = 0;
  constexpr int kN = 20000;
  for (int i = 0; i < kN; ++i) {
    const Vec3d d = direction_near(axis, 0.5, random);
    CHECK(std::abs(d.norm() - 1) < 7e-16);
    CHECK(d.dot(axis) > 0.5 - 1e-12);
    mean += d.dot(axis) / kN;
  }
  CHECK(std::abs(mean - 0.75) < 0.0021);  // even over [.5, 1], so the mean of all deviates by 0.001
  CHECK(std::abs(square_to(axis, random).dot(axis)) < 1e-16);
}
