// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/clearance_map.hpp>
#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 808;

/// Whether any of `points` in the ball that is said to be clear is bone.
bool has_bone(const DensityField<std::uint8_t, double>& field, const Vec3d& p, double radius, std::mt19937& rng,
              int points) {
  for (int i = 0; i < points; ++i)
    if (field.value(p + radius * random_direction(rng)) >= 0) return true;
  return field.value(p) >= 0;
}

}  // namespace

TEST_CASE("What a map of air says to be clear is: fresh, stale, after bone came back, inside and outside of the grid") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  const Vec3d h(3e-4, 2e-4, 5e-4);
  constexpr double kIso = 100;
  // A few lumps of bone, one of them at the edge.
  auto grid = make_grid<std::uint8_t>({.size = {75, 64, 40}, .spacing = h, .outside = 0}, [&](int i, int j, int k) {
    const Vec3d v(i, j, k);
    const bool bone = (v - Vec3d(20, 20, 20)).norm() < 4 || (v - Vec3d(60, 50, 30)).norm() < 7 || (i == 74 && j < 5);
    return bone ? 200.0 : 10.0;
  });
  const DensityField<std::uint8_t, double> field(grid, kIso);
  ClearanceMap<std::uint8_t> map(grid, kIso);
  const Vec3d far = h.cwiseProduct(Vec3d(75, 64, 40));
  double mean = 0;
  const auto check = [&] {
    double sum = 0;
    int wrong = 0;
    for (int n = 0; n < 3000; ++n) {
      const Vec3d p = random_point(rng, -0.7 * far, 1.7 * far);
      const double clear = map.clearance_at(p);
      sum += clear;
      if (clear > 0 && has_bone(field, p, clear, rng, 60)) ++wrong;
    }
    CHECK(wrong == 0);
    mean = sum / 3000;
  };
  check();
  const double fresh = mean;
  CHECK(fresh > 0.006);
  // Stale: bone goes, the map stays as it was.
  const Vec3d c = h.cwiseProduct(Vec3d(60, 50, 30));
  carve(grid, kIso, SphereCutter(c, c, 4e-3));
  map.begin_tick();
  check();
  CHECK(mean == near(fresh, 0.05));
  map.refresh();
  map.begin_tick();
  check();
  CHECK(mean > 1.05 * fresh);
  // Bone comes back: nothing is clear until the map is made anew.
  grid.restore();
  map.begin_tick();
  check();
  CHECK(mean == 0);
  map.refresh();
  map.begin_tick();
  check();
  CHECK(mean == near(fresh, 0.01));
}

TEST_CASE("Maps of air at their edges") {
  auto all = make_grid<std::uint8_t>({.size = {9, 9, 9}, .spacing = Vec3d::Constant(1e-3), .outside = 0},
                                     [](int, int, int) { return 200.0; });
  ClearanceMap<std::uint8_t> bone(all, 100);
  CHECK(bone.clearance_at(Vec3d::Constant(4e-3)) == 0);
  CHECK(bone.clearance_at(Vec3d(0.02, 4e-3, 4e-3)) == near(0.011));  // beyond the border voxel at 9
  CHECK(bone.clearance_at(Vec3d::Constant(std::numeric_limits<double>::quiet_NaN())) == 0);
  ClearanceMap<std::uint8_t> at_isovalue(all, 200);
  CHECK(at_isovalue.clearance_at(Vec3d::Constant(4e-3)) == 0);
  ClearanceMap<std::uint8_t> none(all, 201);
  CHECK(none.clearance_at(Vec3d::Constant(4e-3)) > 1);
  // Bone beyond the grid: nowhere is clear.
  auto inverted = make_grid<std::uint8_t>({.size = {9, 9, 9}, .spacing = Vec3d::Constant(1e-3), .outside = 200},
                                          [](int, int, int) { return 0.0; });
  ClearanceMap<std::uint8_t> hollow(inverted, 100);
  CHECK(hollow.clearance_at(Vec3d::Constant(4e-3)) == 0);
  CHECK(hollow.clearance_at(Vec3d::Constant(1.0)) == 0);
  CHECK_FALSE(DensityField<std::uint8_t, double>(inverted, 100).is_beyond(Vec3d::Constant(1.0), 1e-3));
  CHECK(DensityField<std::uint8_t, double>(all, 100).is_beyond(Vec3d::Constant(1.0), 1e-3));
  CHECK_THROWS_AS(ClearanceMap<std::uint8_t>(all, std::numeric_limits<double>::infinity()), std::invalid_argument);
}
