// SPDX-License-Identifier: MIT
#include "support/near.hpp"

#include <trephine/render/surface/weighting.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kPi = std::numbers::pi;
const Burr kBurr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 20e-3};

TEST_CASE("weighting: the foundation's force on a plane is pi R depth squared") {
  const double R = kBurr.tip_radius;
  const ToolDiscretization<SurfaceCounts, double> many(kBurr, {.sphere = 2000, .slices = 4, .per_slice = 8}),
      few(kBurr, {.sphere = 200, .slices = 4, .per_slice = 8});
  for (const double depth : {0.3, 0.5, 0.9}) {
    CAPTURE(depth);
    const double exact = kPi * R * (depth * R) * (depth * R);
    CHECK(mean_plane_force<AreaWeights>(many, 0, depth) == near(exact, 2.7e-5));
    // Integrals over patches need a tenth of the vertices.
    CHECK(mean_plane_force<PatchWeights>(few, 0, depth) == near(exact, 0.01));
  }
}

TEST_CASE("weighting: the tangent of a quadratic law is 2 sqrt(k pi R F)") {
  const double R = kBurr.tip_radius, k = 4e8;
  const ToolDiscretization<SurfaceCounts, double> tool(kBurr, {.sphere = 400, .slices = 4, .per_slice = 8});
  for (const double force : {0.3, 1.0, 2.0}) {
    CAPTURE(force);
    REQUIRE(force < k * kPi * R * R * R);
    CHECK(plane_tangent<PatchWeights>(tool, k, force) == near(2 * std::sqrt(k * kPi * R * force), 0.0015));
  }
  // Without a force: at half a radius.
  CHECK(plane_tangent<PatchWeights>(tool, k, 0) == near(k * kPi * R * R, 1e-4));
}

TEST_CASE_TEMPLATE("weighting: sums of a few vertices as their equations have them", Scalar, float, double) {
  const Vec3<Scalar> x = Vec3<Scalar>::UnitX(), z = Vec3<Scalar>::UnitZ();
  const Scalar area = Scalar(2e-6), R = Scalar(1.5e-3), a = Scalar(6e-4), b = Scalar(9e-4);
  const auto sum = [&](auto policy) {
    WeightedSum<decltype(policy), Scalar> s;
    s.add(x, a, area, R);
    s.add(z, b, area, R);
    return Vec3<Scalar>(s.result(10));
  };
  const Scalar close = Scalar(1e-5);
  CHECK(sum(CollisionRatio{}).isApprox(Scalar(5) * (a * x + b * z), close));  // Eq. 16: N_total / N_colliding
  CHECK(sum(AreaWeights{}).isApprox(area * (a * x + b * z), close));
  CHECK(sum(MeanWeights{}).isApprox(Scalar(0.5) * (a * x + b * z), close));

  // Nothing in contact, and a vertex that just enters: the mean does not jump, Eq. 16 halves.
  CHECK(WeightedSum<MeanWeights, Scalar>{}.result(10).isZero());
  WeightedSum<MeanWeights, Scalar> mean;
  WeightedSum<CollisionRatio, Scalar> ratio;
  for (auto add : {std::pair{b, z}, std::pair{Scalar(1e-12), x}}) {
    mean.add(add.second, add.first, area, R);
    ratio.add(add.second, add.first, area, R);
  }
  CHECK(mean.result(10).isApprox(b * z, close));
  CHECK(ratio.result(10).isApprox(Scalar(5) * b * z, close));
}

}  // namespace
