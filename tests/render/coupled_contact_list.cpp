// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/render/coupled/contact_list.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 332;
constexpr double kRounding = 4e-15;

/// Contact points of `elements` elements, the points of an element with one normal, and their loads [N].
struct Points {
  std::vector<FoundationPoint> points;
  std::vector<double> loads;

  Points(Random& random, std::uint64_t elements) {
    for (std::uint64_t e = 0; e < elements; ++e) {
      const Vec3d normal = random.unit();
      for (int i = 0; i <= random.below(4); ++i) {
        FoundationPoint& q = points.emplace_back();
        q.arm = 1e-3 * random.unit();
        q.normal = normal;
        q.element = 1000 - 7 * e;  // numbers need no order
        loads.push_back(random.uniform(1e-3, 0.5));
      }
    }
  }
};

TEST_CASE("contact list: forces and moments add up to the wrench of all points and of friction") {
  CAPTURE(kSeed);
  Random random(kSeed);
  ContactList list;
  list.reserve(64);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Points all(random, 30);
    const Vec3d p = random.unit();
    list.clear();
    Vec3d force = Vec3d::Zero(), torque = Vec3d::Zero(), friction = Vec3d::Zero();
    for (std::size_t i = 0; i < all.points.size(); ++i) {
      list.add(all.points[i], all.loads[i]);
      const Vec3d f = -all.loads[i] * all.points[i].normal;
      force += f;
      torque += all.points[i].arm.cross(f);
    }
    list.finish(p);
    REQUIRE(list.contacts().size() == 30);
    Vec3d sum = Vec3d::Zero(), moment = Vec3d::Zero();
    for (const auto& c : list.contacts()) {
      sum += c.force;
      moment += (c.position - p).cross(c.force);
      CHECK(c.normal.norm() == near(1));
      CHECK(c.normal.dot(c.force) == near(c.force.norm()));
    }
    CHECK((sum - force).norm() <= kRounding * force.norm());
    CHECK((moment - torque).norm() <= 500 * kRounding * torque.norm());  // p is hundreds of arms away
    // Friction changes forces alone. An element that is not in the list has no contact to add to.
    for (const FoundationPoint& q : all.points) {
      const Vec3d f = 0.1 * random.unit();
      list.add_force(q.element, f);
      friction += f;
    }
    list.add_force(5000, Vec3d::UnitX());
    sum.setZero();
    for (const auto& c : list.contacts()) sum += c.force;
    CHECK((sum - force - friction).norm() <= kRounding * (force.norm() + friction.norm()));
  }
}

TEST_CASE("contact list: a position is the centre of pressure; elements beyond its room are left out") {
  Random random(kSeed + 1);
  ContactList list;
  list.reserve(3);
  FoundationPoint q{};
  q.normal = Vec3d::UnitZ();
  for (const std::uint64_t element : {9U, 4U, 7U, 8U}) {
    q.element = element;
    for (const double x : {-1e-3, 1e-3}) {
      q.arm = Vec3d(x, 0, 0);
      list.add(q, x > 0 ? 3 : 1);
    }
  }
  list.add_force(4, Vec3d(0, 2, 0));
  list.add_force(8, Vec3d(0, 5, 0));
  list.finish(Vec3d(0, 0, 0.5));
  REQUIRE(list.contacts().size() == 3);
  CHECK_FALSE(list.is_complete());
  for (const auto& c : list.contacts()) {
    CHECK((c.position - Vec3d(5e-4, 0, 0.5)).norm() <= 1e-16);
    CHECK(c.force.z() == -4);
    CHECK(c.normal == Vec3d(0, 0, -1));
  }
  CHECK(list.contacts()[0].force.y() == 0);
  CHECK(list.contacts()[1].force.y() == 2);
  CHECK(list.contacts()[2].force.y() == 0);
  list.clear();
  CHECK(list.contacts().empty());
  CHECK(list.is_complete());
}

}  // namespace
