// SPDX-License-Identifier: MIT
#include "support/near.hpp"

#include <trephine/render/surface/plane_law.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kPi = std::numbers::pi;
const Burr kBurr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 20e-3};

TEST_CASE("plane law: the foundation's force on a plane is pi R depth squared") {
  const double R = kBurr.tip_radius;
  const ToolDiscretization<SurfaceCounts, double> few(kBurr, {.sphere = 200, .slices = 4, .per_slice = 8});
  for (const double depth : {0.3, 0.5, 0.9}) {
    CAPTURE(depth);
    const double exact = kPi * R * (depth * R) * (depth * R);
    CHECK(mean_plane_force(few, 0, depth) == near(exact, 0.01));
  }
}

TEST_CASE("plane law: the tangent of a quadratic law is 2 sqrt(k pi R F)") {
  const double R = kBurr.tip_radius, k = 4e8;
  const ToolDiscretization<SurfaceCounts, double> tool(kBurr, {.sphere = 400, .slices = 4, .per_slice = 8});
  for (const double force : {0.3, 1.0, 2.0}) {
    CAPTURE(force);
    REQUIRE(force < k * kPi * R * R * R);
    CHECK(plane_tangent(tool, k, force) == near(2 * std::sqrt(k * kPi * R * force), 0.0015));
  }
  // Without a force: at half a radius.
  CHECK(plane_tangent(tool, k, 0) == near(k * kPi * R * R, 1e-4));
}

}  // namespace
