// SPDX-License-Identifier: MIT
// Rates of tissues: bits of the plain cut at the scaled rate, speeds in layers, and maps that are refused.
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"
#include "support/raster.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/core/units.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/voxel/density_field.hpp>
#include <trephine/voxel/tissue_cut.hpp>

#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <memory>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

constexpr double kVoxel = 3e-4;
constexpr double kIso = 127.5;
constexpr double kDt = 1e-3;

template <VoxelDensity Density>
VoxelGrid<Density> half_space(double top, double slope, double contrast = 1) {
  return make_grid<Density>(
      {.size = {29, 30, 43}, .spacing = Vec3d::Constant(kVoxel), .outside = static_cast<Density>(contrast * 10)},
      [&](int, int, int k) { return contrast * std::clamp(kIso + slope * (top - k), 10.0, 245.0); });
}

template <VoxelDensity Density>
std::shared_ptr<const TissueMap> uniform_map(const VoxelGrid<Density>& grid, double rate) {
  return std::make_shared<const TissueMap>(grid, std::vector{rate}, [](int, int, int) { return 0; });
}

/// A ball wanders through the bone's surface; returns the removed volumes.
template <VoxelDensity Density, class Policy>
std::vector<double> wander(VoxelGrid<Density>& grid, const Policy& policy) {
  Random random(5);
  std::vector<double> removed;
  Vec3d p = kVoxel * Vec3d(14, 14, 26);
  for (std::uint32_t t = 0; t < 300; ++t) {
    const Vec3d to = p + random.arrow(0, 0.4 * kVoxel);
    removed.push_back(carve(grid, kIso, SphereCutter(p, to, 6 * kVoxel), policy, {.dt = kDt, .tick = t}));
    p = to;
  }
  return removed;
}

}  // namespace

TEST_CASE_TEMPLATE("tissue: a factor everywhere gives the bits of the plain cut at the scaled rate", Density,
                   std::uint8_t, std::int16_t, float) {
  const auto judge = [](const auto& scaled, const auto& plain, double factor) {
    auto expected = half_space<Density>(26.3, 40), got = half_space<Density>(26.3, 40);
    const std::vector<double> removed = wander(expected, plain);
    CHECK(wander(got, TissueCut{scaled, uniform_map(got, factor)}) == removed);
    CHECK(copy_of(got) == copy_of(expected));
    CHECK(removed.back() > 0);
  };
  // A power of two scales without rounding.
  judge(AdvancingCut{.speed = 4e-3}, AdvancingCut{.speed = 1e-3}, 0.25);
  judge(AdvancingCut{.speed = 1e-3}, AdvancingCut{.speed = 2e-3}, 2);
  judge(RateLimitedCut<>{.rate = 4000}, RateLimitedCut<>{.rate = 500}, 0.125);
  judge(RateLimitedCut<>{.rate = 4000}, RateLimitedCut<>{.rate = 4000}, 1);
}

TEST_CASE_TEMPLATE("tissue: the surface recedes through layers at their speeds", Density, std::uint8_t, std::int16_t,
                   float) {
  constexpr double kSpeed = 2e-3;
  // Twelve times the contrast of 8 bits is that of a CT.
  const double contrast = sizeof(Density) == 1 ? 1 : 12, iso = contrast * kIso;
  auto grid = half_space<Density>(34.3, 110, contrast);
  // The layers change at 25.5 and 16.5 voxels.
  const std::array rates{1.0, 0.25, 2.0};
  const auto map = std::make_shared<const TissueMap>(grid, rates, [](int, int, int k) {
    return k > 25 ? 0 : k > 16 ? 1 : 2;
  });
  const DensityField<Density, double> field(grid, iso);
  const Vec3d middle = kVoxel * Vec3d(14, 15, 0);
  double height = 34.3 * kVoxel;
  std::vector<double> heights;
  for (std::uint32_t t = 0; height > 6 * kVoxel; ++t) {
    REQUIRE(t < 9000);
    const Vec3d p(middle.x(), middle.y(), height);
    (void)carve(grid, iso, SphereCutter(p, p, 9 * kVoxel), TissueCut{AdvancingCut{.speed = kSpeed}, map},
                {.dt = kDt, .tick = t});
    while (height > 0 && field.value(Vec3d(middle.x(), middle.y(), height)) < 0) height -= 1e-6;
    heights.push_back(height);
  }
  const auto ticks_to = [&](double voxels) {
    return std::find_if(heights.begin(), heights.end(), [&](double h) { return h < voxels * kVoxel; }) -
           heights.begin();
  };
  const auto speed = [&](double from, double to) {
    return (from - to) * kVoxel / (kDt * static_cast<double>(ticks_to(to) - ticks_to(from)));
  };
  // Away from the borders between layers, where a cell has voxels of both.
  CHECK(speed(32, 28) == near(kSpeed, 0.015));
  CHECK(speed(23, 19) == near(0.25 * kSpeed, 0.035));
  // While the slow layer is cut, bone behind it recedes at each level as it arrives there: its slope is an eighth. In
  // 8 bits that is 3 steps a voxel, and their rounding adds to the steepness.
  CHECK(speed(14, 8) == near(2 * kSpeed, sizeof(Density) == 1 ? 0.25 : 0.02));
}

TEST_CASE("tissue: rows across bricks have each voxel's own rate") {
  auto grid = half_space<std::int16_t>(26, 40);
  Random random(8);
  std::vector<double> rates;
  for (int t = 0; t < 256; ++t) rates.push_back(random.uniform(0.01, 4));
  const auto tissue = [](int i, int j, int k) { return k < 16 ? 3 : (i * 7 + j * 11 + k * 13) % 256; };
  const TissueMap map(grid, rates, tissue);
  int wrong = 0;
  for (int n = 0; n < 3000; ++n) {
    const int count = 1 + random.below(16);
    const int i = random.below(29 - count + 1), j = random.below(30), k = random.below(43);
    std::array<float, 16> share;
    share.fill(0.5F);
    map.scale(i, j, k, count, share);
    for (int l = 0; l < 16; ++l) {
      const double rate = l < count ? rates[static_cast<std::size_t>(tissue(i + l, j, k))] : 1.0;
      wrong += share[static_cast<std::size_t>(l)] != 0.5F * static_cast<float>(rate);
    }
    wrong += map.rate_at(i, j, k) !=
             static_cast<double>(static_cast<float>(rates[static_cast<std::size_t>(tissue(i, j, k))]));
  }
  CHECK(wrong == 0);
  // Two of the six layers of bricks have one tissue: these take 4 bytes a brick.
  CHECK(map.bytes() == 4 * 4 * 4 * 6 + 512 * 4 * 4 * 4 + 4 * 256);
}

TEST_CASE("tissue: with a floor no cut passes it, and options change without the map") {
  auto grid = half_space<std::int16_t>(26.3, 110);
  const auto map = uniform_map(grid, 50);
  const auto floor = std::make_shared<CutFloor<std::int16_t>>(grid, kIso);
  floor->protect(0, {{0, 0, 0}, {28, 29, 42}}, [](int, int, int k) { return (k - 20.5) * kVoxel; });
  floor->seal(grid);
  Mailbox<AdvancingCut> knob;
  HapticScene scene{grid, kIso, LineApproxRenderer{ToolDiscretization{Burr{.tip_radius = 2_mm}, LineCounts{}}},
                    Remote{Cutting{TissueCut{AdvancingCut{.speed = 1e-6}, map}, {.follow_probe = true}}, knob},
                    Veto{floor}};
  const Posed X = make_pose<double>(Mat3d::Identity(), kVoxel * Vec3d(14, 15, 22));
  const auto removed_in = [&](int ticks) {
    double sum = 0;
    for (int t = 0; t < ticks; ++t) sum += scene.tick({.X_WT = X, .spindle_on = true}, kDt).removed_mm3;
    return sum;
  };
  const double slow = removed_in(50);
  knob.post({.speed = 1e-3});
  CHECK(removed_in(50) > 100 * slow);
  const std::int64_t calls = heap_calls([&] { (void)removed_in(500); });
  CHECK(calls == 0);
  CHECK(grid.at(14, 15, 21) < kIso);
  CHECK(grid.at(14, 15, 20) >= kIso);
}

TEST_CASE("tissue: maps of other bones and rates out of reason are refused") {
  auto grid = half_space<std::int16_t>(26, 40);
  const auto zero = [](int, int, int) { return 0; };
  for (const double rate : {0.0, -1.0, 1e-4, 1e4, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS((TissueMap{grid, std::vector{rate}, zero}), std::invalid_argument);
  CHECK_THROWS_AS((TissueMap{grid, std::vector<double>{}, zero}), std::invalid_argument);
  CHECK_THROWS_AS((TissueMap{grid, std::vector<double>(257, 1.0), zero}), std::invalid_argument);
  CHECK_THROWS_AS((TissueMap{grid, std::vector{1.0}, [](int, int, int) { return 1; }}), std::invalid_argument);
  CHECK_THROWS_AS((TissueMap{grid, std::vector{1.0}, [](int, int, int) { return -1; }}), std::invalid_argument);
  CHECK_THROWS_AS((TissueCut{AdvancingCut{}, std::shared_ptr<const TissueMap>()}), std::invalid_argument);
  CHECK_THROWS_AS((TissueCut{AdvancingCut{.speed = -1}, uniform_map(grid, 1)}), std::invalid_argument);

  const std::vector<std::int16_t> voxels(10 * 10 * 10, 200);
  const VoxelGrid<std::int16_t> other({.size = {10, 10, 10}, .spacing = Vec3d::Constant(kVoxel), .outside = 0}, voxels);
  const TissueCut cut{AdvancingCut{}, uniform_map(other, 1)};
  CHECK_THROWS_AS(
      (HapticScene{grid, kIso, LineApproxRenderer{ToolDiscretization{Burr{.tip_radius = 2_mm}, LineCounts{}}},
                   Cutting{cut}}),
      std::invalid_argument);
  const Vec3d p = kVoxel * Vec3d(14, 14, 26);
  CHECK(carve(grid, kIso, SphereCutter(p, p, 6 * kVoxel), cut, {.dt = kDt}) == 0);
}
