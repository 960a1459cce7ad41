// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "support/random.hpp"
#include "support/raster.hpp"

#include <trephine/render/line/shaft_field.hpp>
#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 6120;

TEST_CASE("shaft field: its value is the largest density on the line, its surface the cone that touches a bar") {
  CAPTURE(kSeed);
  Random random(kSeed);
  const RasterOptions o{.size = {48, 48, 48}};
  const Vec3d c = o.middle();
  constexpr double kBar = 2e-3;
  // A round bar along y. Lines from a tip beside it touch it under an angle known in closed form.
  const auto grid =
      rasterise<std::int16_t>([&](const Vec3d& p) { return std::hypot(p.x() - c.x(), p.z() - c.z()) - kBar; }, o);
  using Base = DensityField<std::int16_t, double, SplineGradient>;
  const Base base(grid, o.isovalue());
  const ToolDiscretization<LineCounts, double> tool({.tip_radius = 1e-3, .shaft_radius = 0.5e-3, .shaft_length = 9e-3},
                                                    {.shaft = 200});
  std::vector<double> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const Vec3d tip = c - Vec3d(0, 0, 5e-3);
  const ShaftField<Base> field(base, tool, tip, scratch.data());
  CHECK(field.voxel() == base.voxel());

  for (int i = 0; i < 50; ++i) {
    const double lean = random.uniform(-0.6, 0.6);
    const Vec3d e = tip + 9e-3 * Vec3d(std::sin(lean), 0.2 * random.uniform(-1, 1), std::cos(lean));
    const auto line = field.line_to(e);
    CHECK((line.direction - (e - tip).normalized()).norm() < 1e-12);
    double largest = -1e9;
    for (int v = 0; v < tool.count(); ++v)
      largest = std::max(largest, base.value(line.at(tool.heights()[static_cast<std::size_t>(v)])));
    // Between vertices it may be deeper, and never shallower.
    CHECK(field.value(e) >= largest - 1e-9);
    CHECK(field.value(e) <= largest + 30);
    // The direction alone counts.
    CHECK(field.value(tip + 2 * (e - tip)) == near(field.value(e), 5.4e-15));
  }

  // Leans from the bar's middle outward: the sign changes where the line touches.
  const double touching = std::asin(kBar / 5e-3);
  double low = 0, high = 0.8;
  for (int i = 0; i < 40; ++i) {
    const double lean = 0.5 * (low + high);
    (field.value(tip + Vec3d(std::sin(lean), 0, std::cos(lean)) * 9e-3) >= 0 ? low : high) = lean;
  }
  CHECK(low == near(touching, 0.0061));
  // There the normal is that of the bar, square to the line.
  const Vec3d at = tip + Vec3d(std::sin(touching), 0, std::cos(touching)) * 9e-3;
  Vec3d n = Vec3d::Zero();
  REQUIRE(field.normal(at, n));
  CHECK((n - Vec3d(std::cos(touching), 0, -std::sin(touching))).norm() < 1e-15);
}

TEST_CASE("shaft field: bone straight ahead of the tip has no normal across the line") {
  const RasterOptions o{.size = {32, 32, 32}};
  const auto grid = rasterise<std::int16_t>([&](const Vec3d& p) { return o.middle().z() - p.z(); }, o);
  using Base = DensityField<std::int16_t, double>;
  const Base base(grid, o.isovalue());
  const ToolDiscretization<LineCounts, double> tool({.tip_radius = 1e-3, .shaft_radius = 0.5e-3, .shaft_length = 5e-3},
                                                    {.shaft = 50});
  std::vector<double> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const Vec3d tip = o.middle() - Vec3d(0, 0, 3e-3);
  const ShaftField<Base> field(base, tool, tip, scratch.data());
  Vec3d n = Vec3d::Zero();
  CHECK(!field.normal(tip + Vec3d(0, 0, 5e-3), n));
}

}  // namespace
