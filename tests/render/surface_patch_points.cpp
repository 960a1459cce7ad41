// SPDX-License-Identifier: MIT
#include "support/malloc_hook.hpp"
#include "support/random.hpp"
#include "support/raster.hpp"

#include <trephine/render/surface/patch_points.hpp>
#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 4471;

TEST_CASE("patch points: batches give the gradients of single points, from any point on, after moves and truncation") {
  CAPTURE(kSeed);
  Random random(kSeed);
  const RasterOptions o{.size = {24, 24, 24}};
  const Vec3d c = o.middle();
  const auto grid = rasterise<std::int16_t>([&](const Vec3d& p) { return (p - c).norm() - 2e-3; }, o);
  const DensityField<std::int16_t, double> field(grid, o.isovalue());
  Posed X = Posed::Identity();
  X.linear() = random.rotation();
  X.translation() = c;

  constexpr int kCapacity = 50;
  PatchPoints<double> points(kCapacity);
  std::vector<Vec3d> expected;
  std::vector<int> vertices;
  for (int i = 0; i < kCapacity; ++i) {
    const Vec3d p = random.arrow(1e-3, 3e-3);
    points.add(p, 7 * i);
    expected.push_back(p);
    vertices.push_back(7 * i);
  }
  const auto check = [&](int from) {
    const auto calls = heap_calls([&] { points.compute_gradients(field, X, from); });
    CHECK(calls == 0);
    for (int j = from; j < points.count(); ++j) {
      Vec3d n = Vec3d::Zero();
      REQUIRE(field.normal(X * expected[static_cast<std::size_t>(j)], n));
      // Densities fall outward: the gradient is opposite to the normal.
      CHECK((points.gradient(j).normalized() + n).norm() < 1.6e-14);
    }
  };
  check(0);
  check(kCapacity - 3);
  check(17);
  // Every third point stays.
  int kept = 0;
  for (int j = 0; j < kCapacity; j += 3, ++kept) {
    points.move(j, kept);
    expected[static_cast<std::size_t>(kept)] = expected[static_cast<std::size_t>(j)];
    vertices[static_cast<std::size_t>(kept)] = vertices[static_cast<std::size_t>(j)];
  }
  points.truncate(kept);
  CHECK(points.count() == 17);
  for (int j = 0; j < kept; ++j) CHECK(points.vertex(j) == vertices[static_cast<std::size_t>(j)]);
  check(0);
  points.clear();
  CHECK(points.count() == 0);
}

}  // namespace
