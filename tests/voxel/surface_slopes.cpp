// SPDX-License-Identifier: MIT
// How steep an image is at its surfaces, and that cuts as steep keep the old surface where it is.
#include "support/cases.hpp"
#include "support/figures.hpp"
#include "support/random.hpp"
#include "support/raster.hpp"

#include <trephine/voxel/carving.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 4177;
constexpr double kVoxel = 3e-4;

/// Densities of a function of the place [voxels].
template <VoxelDensity Density, class Value>
VoxelGrid<Density> image_of(const std::array<int, 3>& size, Value&& value) {
  std::vector<Density> voxels;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const double v = value(Vec3d(i, j, k));
        voxels.push_back(static_cast<Density>(std::is_same_v<Density, float> ? v : std::floor(v + 0.5)));
      }
  return VoxelGrid<Density>({.size = size, .spacing = Vec3d::Constant(kVoxel)}, voxels);
}

/// Bone below a plane through the middle of 30³ voxels at a random place; what a ball at its surface removes, and the
/// ball's part in the bone.
template <VoxelDensity Density>
double removed_too_much(Random& random, double sigma, double radius, double of_slope) {
  constexpr bool kBytes = sizeof(Density) == 1;
  const RasterOptions o{.size = {30, 30, 30},
                        .spacing = Vec3d::Constant(kVoxel),
                        .blur = sigma,
                        .contrast = kBytes ? 230.0 : 2000.0,
                        .air = kBytes ? 10.0 : -1000.0};
  const Vec3d n = random.unit(), top = o.middle() + random.arrow(0, kVoxel);
  auto grid = rasterise<Density>([&](const Vec3d& p) { return (p - top).dot(n); }, o);
  const double R = radius * kVoxel, above = random.uniform(-0.5, 0.5) * R, deep = R - above;
  const double exact = std::numbers::pi * deep * deep * (3 * R - deep) / 3 * 1e9;
  const Vec3d p = top + above * n;
  return carve(grid, o.isovalue(), SphereCutter(p, p, R), GeometricCut{}, {},
               of_slope * auto_slope(grid, o.isovalue())) /
             exact -
         1;
}

/// What a ball in bone of a quarter of the contrast removes too much, off what it removes in hard bone.
template <VoxelDensity Density>
double removed_of_soft_bone(Random& random, double sigma, double radius, double of_slope) {
  constexpr bool kBytes = sizeof(Density) == 1;
  constexpr double kAir = kBytes ? 10 : -1000, kHard = kBytes ? 230 : 2000;
  const Vec3d n = random.unit(), place = Vec3d(random.uniform(), random.uniform(), random.uniform());
  const auto removed = [&](double part) {
    // The surface lies beyond the ball; below it bone is hard or soft.
    auto grid = image_of<Density>({30, 30, 30}, [&](const Vec3d& p) {
      const double d = n.dot(p - Vec3d::Constant(14.5)) - 9;
      const double bone = kAir + kHard * (d > -3 ? 1 : part);
      return std::min(bone, kAir + kHard * 0.5 * std::erfc(d / (sigma * std::numbers::sqrt2)));
    });
    const Vec3d p = kVoxel * (Vec3d::Constant(14) + place);
    const double iso = kAir + 0.5 * kHard;
    return carve(grid, iso, SphereCutter(p, p, radius * kVoxel), GeometricCut{}, {}, of_slope * auto_slope(grid, iso));
  };
  return removed(0.625) / removed(1) - 1;
}

}  // namespace

TEST_CASE_TEMPLATE("surface slopes: the gradient of planes, whichever way they lie", Density, std::uint8_t,
                   std::int16_t, float) {
  CAPTURE(kSeed);
  Random random(kSeed);
  for (int n = 0; n < 12; ++n) {
    const double slope = random.uniform(20, 60);
    const Vec3d normal = random.unit();
    const auto grid = image_of<Density>({32, 32, 32}, [&](const Vec3d& p) {
      return std::clamp(127.5 + slope * normal.dot(p - Vec3d(15.7, 16.1, 15.9)), 5.0, 250.0);
    });
    CHECK(std::abs(grid.surface_slope(127.5) / slope - 1) <= (std::is_same_v<Density, float> ? 1.5e-7 : 1.6e-3));
  }
}

TEST_CASE("surface slopes: each isovalue has its own, and none where there is no surface") {
  // Air, soft tissue and bone in layers.
  const auto grid = image_of<std::int16_t>({24, 24, 48}, [](const Vec3d& p) {
    return std::clamp(30 * (p.z() - 10.3), 0.0, 100.0) + std::clamp(400 * (p.z() - 30.6), 0.0, 1500.0);
  });
  CHECK(grid.surface_slope(50) == 30);
  CHECK(grid.surface_slope(800) == 400);
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double beyond : {-1.0, 1601.0, inf, -inf, nan}) CHECK(grid.surface_slope(beyond) == 0);
  CHECK(image_of<float>({8, 8, 8}, [](const Vec3d&) { return 3.0; }).surface_slope(3) == 0);
  const float least = std::numeric_limits<float>::denorm_min();
  CHECK(image_of<float>({8, 8, 8}, [least](const Vec3d& p) {
          return p.x() > 3 ? double{least} : 0.0;
        }).surface_slope(0) == 0);
  CHECK(image_of<float>({8, 1, 8}, [](const Vec3d& p) { return p.x(); }).surface_slope(3) == 0);
}

TEST_CASE("surface slopes: a sample of a large image tells as much as all of it") {
  // Three times as many voxels as are read.
  const std::array<int, 3> size{256, 256, 192};
  static_assert(std::size_t{256} * 256 * 192 > 2 * SurfaceSlopes::kVoxels);
  const auto grid = image_of<std::uint8_t>(size, [](const Vec3d& p) {
    return std::clamp(127.5 + 40 * (60 - (p - Vec3d(128, 128, 96)).norm()), 0.0, 255.0);
  });
  CHECK(std::abs(grid.surface_slope(127.5) / 40 - 1) < 3e-4);
}

TEST_CASE_TEMPLATE("surface slopes: a cut leaves the old surface beside it, and soft bone inside hard bone", Density,
                   std::uint8_t, std::int16_t, float) {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  for (const double steepness : {1 / 16.0, 0.25, 0.5, 1.0, 4.0}) {
    Figures at_surface, soft;
    for (int n = 0; n < cases(24); ++n)
      for (const double sigma : {0.5, 0.7, 1.0})
        for (const double radius : {3.0, 5.0}) {
          at_surface.add(std::abs(removed_too_much<Density>(random, sigma, radius, steepness / kSteepness)));
          soft.add(std::abs(removed_of_soft_bone<Density>(random, sigma, radius, steepness / kSteepness)));
        }
    MESSAGE("slope over the image's own ", steepness, ": removed off at the surface ", at_surface, "; in soft bone ",
            soft);
    if (steepness != kSteepness) continue;
    CHECK(at_surface.median() <= 0.02);
    CHECK(at_surface.worst() <= 0.1);
    CHECK(soft.median() <= 0.02);
    CHECK(soft.worst() <= 0.08);
  }
}
