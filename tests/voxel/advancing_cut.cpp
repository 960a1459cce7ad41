// SPDX-License-Identifier: MIT
// Bone whose surface recedes at a speed under the cutter: AdvancingCut.
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <string>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kVoxel = 3e-4;
constexpr double kIso = 127.5;
constexpr double kDt = 1e-3;

/// Bone below z = `top` voxels, its edge a ramp of `slope` densities a voxel between `air` and `bone`.
template <VoxelDensity Density>
VoxelGrid<Density> ramp(double top, double slope, double air = 10, double bone = 245) {
  return make_grid<Density>({.size = {32, 32, 40}, .spacing = Vec3d::Constant(kVoxel), .outside = air},
                            [&](int, int, int k) { return std::clamp(kIso + slope * (top - k), air, bone); });
}

/// Height of the surface over the grid's middle [m], looked for from above.
template <class Field>
double height(const Field& field, const Vec3d& middle, double from) {
  double z = from;
  while (z > 0 && field.value(Vec3d(middle.x(), middle.y(), z)) < 0) z -= 1e-6;
  return z;
}

template <VoxelDensity Density, class Policy>
double cut(VoxelGrid<Density>& grid, const Vec3d& p, double radius, const Policy& policy, std::uint32_t tick) {
  return carve(grid, kIso, SphereCutter(p, p, radius), policy, {.dt = kDt, .tick = tick});
}

}  // namespace

TEST_CASE_TEMPLATE("advancing: the surface recedes at the speed, on every contrast", Density, std::uint8_t,
                   std::int16_t, float) {
  constexpr double kSpeed = 1e-3;
  constexpr int kTicks = 600;  // two voxels
  for (const double slope : {20.0, 50.0, 110.0}) {
    auto grid = ramp<Density>(20.3, slope);
    const Vec3d p = kVoxel * Vec3d(16, 16, 20);
    const DensityField<Density, double> field(grid, kIso);
    const double before = height(field, p, 30 * kVoxel);
    double most = 0, last = before;
    for (int t = 0; t < kTicks; ++t) {
      (void)cut(grid, p, 9 * kVoxel, AdvancingCut{.speed = kSpeed}, static_cast<std::uint32_t>(t));
      const double now = height(field, p, 30 * kVoxel);
      most = std::max(most, std::abs(last - now));
      last = now;
    }
    CAPTURE(slope);
    constexpr double kRounding = 0.07;  // a sharp edge is rounded first
    CHECK(std::abs((before - last) / (kSpeed * kDt * kTicks) - 1) <= kRounding);
    // A density or two of the ramp: integers fall by whole ones.
    CHECK(most <= (std::is_same_v<Density, float> ? 0.02 : 0.1) * kVoxel);
  }
}

TEST_CASE("advancing: in thick slices the surface recedes at the speed, along them and across") {
  constexpr double kSpeed = 1e-3;
  constexpr int kTicks = 600;
  for (int across = 0; across < 3; ++across) {
    Vec3d h = Vec3d::Constant(kVoxel);
    h[across] *= 3;
    auto grid = make_grid<float>({.size = {40, 40, 40}, .spacing = h, .outside = 10}, [&](int, int, int k) {
      return std::clamp(kIso + 60 * (20.3 * h.z() - k * h.z()) / h.z(), 10.0, 245.0);
    });
    const Vec3d p = 20 * h;
    const DensityField<float, double> field(grid, kIso);
    const double before = height(field, p, 30 * h.z());
    for (std::uint32_t t = 0; t < kTicks; ++t) (void)cut(grid, p, 13 * kVoxel, AdvancingCut{.speed = kSpeed}, t);
    CAPTURE(across);
    constexpr double kRounding = 0.07;  // a sharp edge is rounded first
    CHECK(before - height(field, p, 30 * h.z()) == near(kSpeed * kDt * kTicks, kRounding));
  }
}

TEST_CASE("advancing: bone ahead of the surface keeps its densities, and nothing lets go at once") {
  const Vec3d p = kVoxel * Vec3d(16, 16, 20);
  const auto greatest_step = [&](const auto& policy, int ticks, bool& kept) {
    auto grid = ramp<std::uint8_t>(20.3, 80);
    const int ahead = grid.at(16, 16, 14);
    const DensityField<std::uint8_t, double> field(grid, kIso);
    double step = 0, last = height(field, p, 30 * kVoxel);
    for (int t = 0; t < ticks; ++t) {
      (void)cut(grid, p, 9 * kVoxel, policy, static_cast<std::uint32_t>(t));
      const double now = height(field, p, 30 * kVoxel);
      step = std::max(step, last - now);
      last = now;
    }
    kept = grid.at(16, 16, 14) >= ahead - 2;  // integers fall by whole ones now and then
    return step;
  };
  bool kept = false;
  CHECK(greatest_step(AdvancingCut{.speed = 1e-3}, 450, kept) <= 0.05 * kVoxel);  // whole densities
  CHECK(kept);
  // What wears all that the burr covers alike goes through it in a tick.
  CHECK(greatest_step(RateLimitedCut<>{.rate = 150}, 900, kept) > kVoxel);
  CHECK_FALSE(kept);
}

TEST_CASE("advancing: adds no bone, goes no farther than the geometric cut and gets there") {
  auto slow = ramp<std::uint8_t>(20.3, 40);
  auto whole = ramp<std::uint8_t>(20.3, 40);
  const Vec3d p = kVoxel * Vec3d(16.2, 15.7, 19.4);
  constexpr double kRadius = 5 * kVoxel;
  double removed = 0;
  int added = 0, farther = 0;
  const double all = cut(whole, p, kRadius, GeometricCut{}, 0);
  const auto target = copy_of(whole);
  for (std::uint32_t t = 0; t < 3000; ++t) {
    const auto before = copy_of(slow);
    removed += cut(slow, p, kRadius, AdvancingCut{.speed = 2e-3}, t);
    const auto after = copy_of(slow);
    for (std::size_t i = 0; i < after.size(); ++i) {
      added += after[i] > before[i];
      farther += after[i] < kIso && target[i] >= kIso;
    }
  }
  CHECK(added == 0);
  CHECK(farther == 0);
  // Voxels a hair within the reach have next to no rate.
  CHECK(removed == near(all, 1e-4));
}

TEST_CASE_TEMPLATE("cuts in time: to and fro over a scanned face, the same whatever the tick", Density, std::uint8_t,
                   std::int16_t, float) {
  constexpr bool kBytes = sizeof(Density) == 1;
  constexpr double kAir = 10, kBone = kBytes ? 245 : 2700;
  constexpr double kSpeed = 0.1, kWay = 20 * kVoxel, kTime = 0.4;
  const double iso = (kAir + kBone) / 2;
  const auto removed = [&](const auto& policy, double dt) {
    auto grid = make_grid<Density>({.size = {44, 24, 16}, .spacing = Vec3d::Constant(kVoxel), .outside = kAir},
                                   [&](int, int, int k) {
                                     const double v = blurred(kAir, kBone, (k - 8.3) / 0.7);
                                     return std::is_same_v<Density, float> ? v : std::floor(v + 0.5);
                                   });
    Cutting milling{policy};
    const auto at = [](double t) {
      const double s = std::fmod(kSpeed * t, 2 * kWay);
      return make_pose<double>(Mat3d::Identity(),
                               Vec3d(12 * kVoxel + std::min(s, 2 * kWay - s), 12 * kVoxel, 11.8 * kVoxel));
    };
    double sum = 0;
    const int ticks = static_cast<int>(std::lround(kTime / dt));
    for (int t = 0; t < ticks; ++t)
      sum += milling.carve(grid, iso, at(t * dt), at((t + 1) * dt), Burr{.tip_radius = 5 * kVoxel},
                           {.dt = dt, .force_N = 2});
    return sum;
  };
  const auto check = [&](const std::string& name, const auto& policy) {
    // Bytes fall by whole densities, each some hundredth of a voxel of this face.
    constexpr double kBound = kBytes ? 0.028 : 0.01;
    const double truth = removed(policy, kDt / 16);
    for (const double dt : {kDt / 4, kDt, 4 * kDt}) {
      const double off = removed(policy, dt) / truth - 1;
      CHECK(std::abs(off) <= kBound);
      MESSAGE(name, ", ticks of ", 1e3 * dt, " ms: off by ", off);
    }
  };
  check("at a speed", AdvancingCut{.speed = 2e-3});
  check("by a rate", RateLimitedCut<>{.rate = 6 * (kBone - kAir)});
}

TEST_CASE("advancing: presses, waits, repeats itself, allocates nothing and refuses what cannot be") {
  const Vec3d p = kVoxel * Vec3d(16, 16, 20);
  const auto run = [&](const AdvancingCut& policy, double force) {
    auto grid = ramp<std::uint8_t>(20.3, 40);
    double removed = 0;
    const auto heap = heap_calls([&] {
      for (std::uint32_t t = 0; t < 200; ++t)
        removed += carve(grid, kIso, SphereCutter(p, p, 5 * kVoxel), policy, {.dt = kDt, .force_N = force, .tick = t});
    });
    CHECK(heap == 0);
    return std::pair(removed, copy_of(grid));
  };
  const AdvancingCut pressed{.speed = 1e-3, .reference_force = 2};
  const auto once = run(pressed, 2);
  CHECK(run(pressed, 2) == once);
  CHECK(run(AdvancingCut{.speed = 1e-3}, 0) == once);
  CHECK(run(pressed, 1).first == near(run(AdvancingCut{.speed = 0.5e-3}, 0).first));
  CHECK(run(pressed, 0).first == 0);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, inf}) {
    CHECK_THROWS_WITH_AS((Cutting{AdvancingCut{.speed = bad}}),
                         doctest::Contains("trephine::AdvancingCut: speed must be > 0"), std::invalid_argument);
    CHECK_THROWS_AS((Cutting{AdvancingCut{.most_force_factor = bad}}), std::invalid_argument);
  }
  CHECK_THROWS_AS((Cutting{AdvancingCut{.reference_force = -1}}), std::invalid_argument);
}
