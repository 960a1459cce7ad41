// SPDX-License-Identifier: MIT
#include "support/raster.hpp"

#include <trephine/contact/cutting_planes.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Problem {
  VertexPatch<double> patch;
  std::vector<DepthPlane<double>> planes;
  [[nodiscard]] double depth(const Vec3d& p) const {
    double least = planes[0](p);
    for (const auto& plane : planes) least = std::min(least, plane(p));
    return least;
  }
};

// Up to three planes that meet near a patch of a ball of 1.5 mm or of a shaft of 0.8 mm, deeper toward the tool.
Problem make_problem(Random& random, bool ball, int count) {
  const double radius = ball ? 0.0015 : 0.0008;
  const double angle = random.uniform(0.2, 1);
  const Vec3d any = random.rotation() * Vec3d::UnitZ();
  const Vec3d axis = ball ? any : Vec3d(any.x(), any.y(), 0).normalized();
  const double height = ball ? 0 : 0.004;
  Problem made{{axis, radius, std::cos(angle), std::sin(angle), ball, height}, {}};
  const Vec3d near = made.patch.farthest(axis + 0.3 * (random.rotation() * Vec3d::UnitX()));
  for (int i = 0; i < count; ++i) {
    const Vec3d g = (axis + random.uniform(0.1, 0.9) * (random.rotation() * Vec3d::UnitY())) * random.uniform(0.5, 1.5);
    made.planes.emplace_back(near, random.uniform(-1e-6, 1e-6), g);
  }
  return made;
}

// The patch' deepest place by brute force: a grid over it, then ever finer ones round the best.
double deepest_by_force(const Problem& problem) {
  const VertexPatch<double>& patch = problem.patch;
  const double widest = std::acos(patch.cosine);
  const Vec3d u = patch.ball ? patch.axis.unitOrthogonal() : Vec3d::UnitZ();
  const Vec3d v = patch.axis.cross(u);
  const auto at = [&](double a, double b) {
    const double angle = std::min(widest, std::hypot(a, b));
    const double phi = std::atan2(b, a);
    const Vec3d beside = patch.ball ? Vec3d(std::cos(phi) * u + std::sin(phi) * v) : Vec3d(b < 0 ? -v : v);
    return patch.raised(patch.radius * (std::cos(angle) * patch.axis + std::sin(angle) * beside));
  };
  double best = -1, best_a = 0, best_b = 0, reach = widest;
  for (int round = 0; round < 60; ++round, reach *= 0.7) {
    const double a0 = best_a, b0 = best_b;
    const int wide = round == 0 ? 40 : 6;
    for (int i = patch.ball ? -wide : 0; i <= (patch.ball ? wide : 0); ++i)
      for (int k = -wide; k <= wide; ++k) {
        const double a = a0 + reach * i / wide, b = b0 + reach * k / wide;
        if (const double depth = problem.depth(at(a, b)); depth > best) {
          best = depth;
          best_a = a;
          best_b = b;
        }
      }
  }
  return best;
}

TEST_CASE("cutting planes: the deepest place of a patch against brute force") {
  Random random(31);
  double off = 0, apart = 0;
  int binding[4]{};
  for (int trial = 0; trial < 1500; ++trial) {
    const Problem problem = make_problem(random, trial % 3 != 0, 1 + trial % 4 / 2 + trial % 2);
    CuttingPlanes<double> planes;
    for (const auto& plane : problem.planes) planes.add(plane);
    const Vec3d p = planes.deepest(problem.patch);
    // On the patch.
    const Vec3d across = problem.patch.across(p);
    CHECK(std::abs(across.norm() - problem.patch.radius) <= 1e-12);
    CHECK(problem.patch.axis.dot(across) >= problem.patch.radius * problem.patch.cosine - 1e-12);
    const double depth = problem.depth(p);
    off = std::max(off, deepest_by_force(problem) - depth);
    // No place is deeper: the mixture, nowhere below the least plane, is greatest there and no more.
    apart = std::max(apart, std::abs(planes.mixture()(p) - depth));
    CHECK((problem.patch.farthest(planes.mixture().gradient) - p).norm() <= 1e-6 * problem.patch.radius);
    const auto binds = std::count_if(problem.planes.begin(), problem.planes.end(),
                                     [&](const auto& plane) { return std::abs(plane(p) - depth) <= 1e-12; });
    ++binding[binds];
  }
  MESSAGE("planes that bind: one in ", binding[1], ", two in ", binding[2], ", three in ", binding[3]);
  CHECK(off <= 1e-12);
  CHECK(apart <= 1e-12);
  for (const int n : {1, 2, 3}) CHECK(binding[n] >= 20);
}

}  // namespace
