// SPDX-License-Identifier: MIT
#include "support/raster.hpp"

#include <trephine/render/contact_friction.hpp>

#include <doctest/doctest.h>

#include <utility>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

// What k times a spring's stretch is, over k, of all `found`: [m].
Vec3d settled(FrictionContacts<Coulomb>& friction, const std::vector<VertexContact>& found, const Posed& X) {
  Vec3d sum = Vec3d::Zero();
  for (const VertexContact& c : found) sum += c.weight * friction.settle(c, X);
  friction.end();
  return sum;
}

double energy(const FrictionContacts<Coulomb>& friction, const std::vector<VertexContact>& found, const Posed& X) {
  double sum = 0;
  for (const VertexContact& c : found) sum += c.weight * friction.energy(c, X);
  return sum;
}

VertexContact contact(int vertex, double weight) {
  return {.vertex = vertex, .depth = 1e-3, .out = Vec3d::UnitZ(), .weight = weight};
}

Posed at(const Vec3d& p) { return make_pose<double>(Mat3d::Identity(), p); }

// A spring of stiffness k w stretched by s: force k w s, energy ½ k w s². What is felt stays where w grows, so that the
// energy falls with w before over w; where w falls the stretch stays, and energy goes with the weight.
TEST_CASE("a place's friction keeps its force as its weight grows, and its stretch as that falls") {
  FrictionContacts<Coulomb> friction(Coulomb(1, 1), 1);
  const Posed X = at(Vec3d(1e-4, 0, 0));
  const auto tick = [&](double weight, const Posed& from, const Posed& to) {
    const std::vector<VertexContact> found{contact(0, weight)};
    friction.begin(from);
    friction.enter(found, from);
    const double held = energy(friction, found, to);
    return std::pair(settled(friction, found, to), held);
  };
  const auto pulled = tick(0.4, at(Vec3d::Zero()), X);
  CHECK((pulled.first - Vec3d(-0.4e-4, 0, 0)).norm() <= 1e-18);
  CHECK(pulled.second == doctest::Approx(0.4e-8));
  const auto grown = tick(0.8, X, X);
  CHECK((grown.first - pulled.first).norm() <= 1e-18);
  CHECK(grown.second == doctest::Approx(0.2e-8));
  const auto fallen = tick(0.2, X, X);
  CHECK((fallen.first - Vec3d(-0.1e-4, 0, 0)).norm() <= 1e-18);
  CHECK(fallen.second == doctest::Approx(0.05e-8));
}

TEST_CASE("places of a vertex share its spring") {
  FrictionContacts<Coulomb> friction(Coulomb(1, 1), 2);
  const Posed rest = at(Vec3d::Zero()), X = at(Vec3d(1e-4, 2e-4, 0));
  const std::vector<VertexContact> apart{contact(1, 0.3), contact(1, 0.7)}, together{contact(1, 1)};
  friction.begin(rest);
  friction.enter(apart, rest);
  const Vec3d force = settled(friction, apart, X);
  CHECK((force - Vec3d(-1e-4, -2e-4, 0)).norm() <= 1e-18);
  friction.begin(X);
  friction.enter(together, X);
  CHECK((settled(friction, together, X) - force).norm() <= 1e-18);
}

// Weights that change while the tool stands still: what the springs hold may be lost, never won.
TEST_CASE("no energy comes with weights") {
  Random random(5);
  FrictionContacts<Coulomb> friction(Coulomb(0.5, 0.4), 3);
  Posed X = at(Vec3d::Zero());
  double held = 0, lost = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<VertexContact> found;
    for (int v = 0; v < 3; ++v)
      for (int n = 0; n < 2; ++n)
        if (random.uniform() < 0.7) found.push_back(contact(v, random.uniform(0.01, 1)));
    friction.begin(X);
    friction.enter(found, X);
    const double now = energy(friction, found, X);
    REQUIRE(now <= held * (1 + 1e-12));
    lost += held - now;
    X.translation() += 2e-4 * random.unit();
    static_cast<void>(settled(friction, found, X));
    friction.begin(X);
    friction.enter(found, X);
    held = energy(friction, found, X);
  }
  CHECK(lost > 0);
}

}  // namespace
