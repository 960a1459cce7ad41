// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/raster.hpp"
#include "voxel/fields.hpp"

#include <trephine/voxel/bone_surface.hpp>
#include <trephine/voxel/carving.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 302;
constexpr double kPi = 3.14159265358979323846;
constexpr double kH = 3e-4;

/// A patch as the store keeps it, to compare bit by bit.
struct Kept {
  float x, y, z, sx, sy, sz, area;
  bool operator==(const Kept&) const = default;
};
/// All that a surface has, by voxel edge: 3 · (index of the edge's first voxel in the padded array) + axis.
struct AllPatches {
  std::map<std::size_t, Kept> kept;
  std::vector<SurfacePatch> patches;
  int twice = 0;   // edges that have two
  int denied = 0;  // bricks that provide() refused
};

template <class Density>
void add_brick(const BoneSurface<Density>& surface, std::size_t brick, AllPatches& all) {
  const auto& grid = surface.grid();
  const auto at = grid.brick_coordinates(brick);
  surface.for_each_block(brick, [&](const PatchBlock& b, int count) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const int e = b.edge[i] / 3;
      const std::size_t key = 3 * grid.index(8 * at[0] + e % 9 - 1, 8 * at[1] + e / 9 % 9 - 1, 8 * at[2] + e / 81 - 1) +
                              static_cast<std::size_t>(b.edge[i] % 3);
      all.twice += all.kept.count(key) > 0 ? 1 : 0;
      all.kept[key] = {b.x[i], b.y[i], b.z[i], b.sx[i], b.sy[i], b.sz[i], b.area[i]};
      all.patches.push_back(surface.patch(b, i, surface.corner(brick)));
    }
  });
}

/// Every brick of a surface, each in a tick of its own.
template <class Density>
AllPatches all_of(BoneSurface<Density>& surface) {
  AllPatches all;
  for (std::size_t brick = 0; brick < surface.grid().brick_count(); ++brick) {
    surface.begin_tick();
    surface.begin_use();
    if (!surface.crosses(brick)) continue;
    if (surface.provide(brick))
      add_brick(surface, brick, all);
    else
      ++all.denied;
  }
  return all;
}

template <class Density>
AllPatches all_anew(const VoxelGrid<Density>& grid, double isovalue) {
  BoneSurface<Density> surface(grid, isovalue);
  return all_of(surface);
}

/// Share χ of each voxel edge whose ends lie on different sides, by its definition: g_a⁸ / Σ g⁸ with g the density's
/// gradient per voxel where the interpolant crosses the isovalue.
template <class Density>
std::map<std::size_t, double> shares_of(const VoxelGrid<Density>& grid, double isovalue) {
  std::map<std::size_t, double> shares;
  const auto value = [&](std::array<int, 3> v) { return density_at(grid, v[0], v[1], v[2]); };
  const auto moved = [](std::array<int, 3> v, std::size_t a, int n) {
    v[a] += n;
    return v;
  };
  for (int k = -1; k < grid.size()[2]; ++k)
    for (int j = -1; j < grid.size()[1]; ++j)
      for (int i = -1; i < grid.size()[0]; ++i)
        for (std::size_t a = 0; a < 3; ++a) {
          const std::array<int, 3> v{i, j, k}, w = moved(v, a, 1);
          if ((value(v) >= isovalue) == (value(w) >= isovalue)) continue;
          const double rise = value(w) - value(v), f = (isovalue - value(v)) / rise;
          double others = 0;
          for (const std::size_t b : {(a + 1) % 3, (a + 2) % 3}) {
            const double at_v = (value(moved(v, b, 1)) - value(moved(v, b, -1))) / 2;
            const double at_w = (value(moved(w, b, 1)) - value(moved(w, b, -1))) / 2;
            others += std::pow((at_v + f * (at_w - at_v)) / rise, 8);
          }
          shares[3 * grid.index(i, j, k) + a] = 1 / (1 + others);
        }
  return shares;
}

/// Edges that should have a patch and have none, and the other way round.
int holes(const AllPatches& all, const std::map<std::size_t, double>& shares) {
  // Below .01 a patch is left out; eighth powers in single precision are good to some 1e-6 of that.
  constexpr double kLeast = 0.01, kRounding = 1e-6;
  int wrong = 0;
  for (const auto& [key, share] : shares) {
    const bool has = all.kept.count(key) > 0;
    wrong += (share > kLeast + kRounding && !has) || (share < kLeast - kRounding && has) ? 1 : 0;
  }
  for (const auto& [key, kept] : all.kept) wrong += shares.count(key) > 0 ? 0 : 1;
  return wrong;
}

double middle_of(const auto& grid) {
  const double lo = static_cast<double>(grid.original_range().min), hi = static_cast<double>(grid.original_range().max);
  return lo + 0.45 * (hi - lo);
}

TEST_CASE_TEMPLATE("bone surface: patches lie on the interpolant's isosurface, one on every crossed edge", Density,
                   std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, float) {
  CAPTURE(kSeed);
  // Single precision of places up to nine voxels from a brick's corner, in densities: the change along an edge times
  // nine roundings, and of the interpolation itself.
  constexpr double kRounding = 12 * 1.2e-7;
  std::mt19937 rng(kSeed);
  Figures off;
  for (const Vec3d& h : {Vec3d(3e-4, 3e-4, 3e-4), Vec3d(2e-4, 3e-4, 15e-4)}) {
    const auto noise = random_grid<Density>({.size = {29, 17, 24}, .spacing = h, .outside = 1}, rng);
    const double contrast = std::is_same_v<Density, float> ? 5 : 120;
    const RasterOptions o{.size = {33, 26, 16}, .spacing = h, .contrast = contrast};
    const auto smooth = rasterise<Density>(Ball{o.middle(), 0.45 * h.cwiseProduct(Vec3d(33, 26, 16)).minCoeff()}, o);
    for (const auto* grid : {&noise, &smooth}) {
      const double isovalue = middle_of(*grid);
      const double range =
          static_cast<double>(grid->original_range().max) - static_cast<double>(grid->original_range().min);
      const AllPatches all = all_anew(*grid, isovalue);
      CHECK(all.patches.size() > 300);
      CHECK(all.twice == 0);
      CHECK(all.denied == 0);
      CHECK(holes(all, shares_of(*grid, isovalue)) == 0);
      Figures spread;
      for (const SurfacePatch& p : all.patches) {
        off.add(std::abs(interpolate(*grid, p.position) - isovalue) / range);
        spread.add((p.along.norm() + p.across.norm()) / h.maxCoeff());
      }
      CHECK(spread.worst() <= BoneSurface<Density>::kGreatestSpread);
    }
  }
  MESSAGE("density off the isovalue, of the contrast: ", off);
  CHECK(off.worst() <= kRounding);
}

// A window that falls off smoothly: a sum over patches is its integral but for what patches stand for.
TEST_CASE("bone surface: areas add up to a plane's and a sphere's, whatever the orientation and the spacing") {
  CAPTURE(kSeed);
  constexpr double kAreaError = 0.01;  // asked for
  for (const Vec3d& h : {Vec3d(kH, kH, kH), Vec3d(0.7 * kH, kH, 1.4 * kH)}) {
    Random random(kSeed + 1);
    Figures plane, sphere;
    for (int i = 0; i < 12; ++i) {
      const RasterOptions o{.size = {72, 56, 48}, .spacing = h, .contrast = 20000, .air = -10000};
      const Vec3d n = i == 0 ? Vec3d(Vec3d::UnitZ()) : random.unit();
      const Vec3d at = o.middle() + 0.5 * random.uniform() * h;
      const double width = 4 * kH;
      const auto grid = rasterise<std::int16_t>(HalfSpace{at, n}, o);
      double area = 0;
      for (const SurfacePatch& p : all_anew(grid, o.isovalue()).patches)
        area += p.area * std::exp(-(p.position - at).squaredNorm() / (2 * width * width));
      plane.add(std::abs(area / (2 * kPi * width * width) - 1));
      if (i >= 4) continue;
      const double R = 15 * kH * 0.7;
      const auto ball = rasterise<std::int16_t>(Ball{at, R}, o);
      area = 0;
      for (const SurfacePatch& p : all_anew(ball, o.isovalue()).patches) area += p.area;
      sphere.add(std::abs(area / (4 * kPi * R * R) - 1));
    }
    MESSAGE("spacing ", 1e3 * h.x(), " x ", 1e3 * h.y(), " x ", 1e3 * h.z(), " mm: area of planes off by ", plane,
            ", of spheres by ", sphere);
    CHECK(plane.worst() <= kAreaError);
    CHECK(sphere.worst() <= kAreaError);
  }
}

TEST_CASE("bone surface: bone that the volume cuts off ends in a face") {
  for (const int n : {15, 16, 17}) {
    CAPTURE(n);
    const auto grid = make_grid<std::uint8_t>({.size = {n, n, n}, .spacing = Vec3d::Constant(kH), .outside = 0},
                                              [](int, int, int) { return 200; });
    const AllPatches all = all_anew(grid, 100);
    CHECK(all.patches.size() == static_cast<std::size_t>(6 * n * n));
    int outside = 0;
    for (const SurfacePatch& p : all.patches) {
      const Vec3d from_middle = p.position - Vec3d::Constant((n - 1) * kH / 2);
      outside += std::abs(from_middle.cwiseAbs().maxCoeff() / (n * kH / 2) - 1) < 1e-6 ? 0 : 1;
    }
    CHECK(outside == 0);
  }
  // Where bone goes on beyond the volume there is no face.
  const auto endless = make_grid<std::uint8_t>({.size = {16, 16, 16}, .spacing = Vec3d::Constant(kH), .outside = 200},
                                               [](int, int, int) { return 200; });
  CHECK(all_anew(endless, 100).patches.empty());
}

TEST_CASE_TEMPLATE("bone surface: a cut shows once it is provided anew, restore() brings the first back", Density,
                   std::uint8_t, std::int16_t, float) {
  const RasterOptions o{.size = {40, 33, 32}, .contrast = 100};
  auto grid = rasterise<Density>(HalfSpace{o.middle(), Vec3d(0.2, 0.1, 1).normalized()}, o);
  BoneSurface<Density> surface(grid, o.isovalue());
  const AllPatches before = all_of(surface);
  const auto as_kept = [&] {
    AllPatches all;
    for (std::size_t b = 0; b < grid.brick_count(); ++b)
      if (surface.crosses(b)) add_brick(surface, b, all);
    return all;
  };
  const SphereCutter cutter(o.middle(), o.middle() + Vec3d(2 * kH, kH, -kH), 4 * kH);
  std::vector<std::size_t> first;
  for (std::size_t b = 0; b < grid.brick_count(); ++b)
    if (surface.crosses(b)) first.push_back(b);
  REQUIRE(carve(grid, o.isovalue(), cutter) > 0);
  AllPatches unasked;
  for (const std::size_t b : first) add_brick(surface, b, unasked);
  CHECK(unasked.kept == before.kept);
  const AllPatches after = all_of(surface);
  CHECK(after.kept != before.kept);
  CHECK(after.kept == all_anew(grid, o.isovalue()).kept);
  CHECK(as_kept().kept == after.kept);
  CHECK(holes(after, shares_of(grid, o.isovalue())) == 0);
  grid.restore();
  CHECK(all_of(surface).kept == before.kept);
}

// Bricks of nothing but surface: each takes all blocks that the smallest store has.
TEST_CASE("bone surface: the smallest store answers as a large one, in any order of asking") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 2);
  constexpr std::size_t kFewest = 35;
  const GridGeometry geometry{.size = {40, 24, 24}, .spacing = Vec3d::Constant(kH), .outside = 0};
  const auto noise = random_grid<std::uint8_t>(geometry, rng);
  const auto chess = make_grid<std::uint8_t>(geometry, [](int i, int j, int k) { return (i + j + k) % 2 * 200; });
  const RasterOptions o{.size = {40, 24, 24}};
  const auto smooth = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  for (const auto* grid : {&noise, &chess, &smooth}) {
    BoneSurface<std::uint8_t> large(*grid, 100), small(*grid, 100, kFewest);
    const AllPatches all = all_of(large);
    CHECK(all_of(small).kept == all.kept);
    int differ = 0;
    for (int i = 0; i < 300; ++i) {
      const std::size_t brick = rng() % grid->brick_count();
      if (i % 7 == 0) small.begin_use();
      small.begin_tick();
      large.begin_tick();
      if (!small.crosses(brick)) continue;
      AllPatches a, b;
      if (small.provide(brick)) add_brick(small, brick, a);
      if (large.provide(brick)) add_brick(large, brick, b);
      differ += a.kept == b.kept && !a.kept.empty() ? 0 : 1;
    }
    CHECK(differ == 0);
  }
  CHECK_THROWS_AS(BoneSurface<std::uint8_t>(noise, 100, kFewest - 1), std::invalid_argument);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(BoneSurface<std::uint8_t>(noise, bad), std::invalid_argument);
}

TEST_CASE("bone surface: a tick makes so many bricks and no more, and none takes memory") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 3);
  const auto grid =
      random_grid<std::uint8_t>({.size = {56, 48, 48}, .spacing = Vec3d::Constant(kH), .outside = 0}, rng);
  using Surface = BoneSurface<std::uint8_t>;
  REQUIRE(grid.brick_count() > 2 * Surface::kBricksPerTick - 50);
  for (const std::size_t blocks : {std::size_t{35}, std::size_t{16384}}) {
    Surface surface(grid, 100, blocks);
    const auto heap = heap_calls([&] {
      surface.begin_tick();
      static_cast<void>(surface.provide(0));
    });
    CHECK(heap == 0);
    surface.begin_tick();
    int provided = 0, wrong = 0;
    std::int64_t calls = 0;
    for (std::size_t b = 1; b < grid.brick_count(); ++b) {
      bool ok = false;
      calls += heap_calls([&] { ok = surface.provide(b); });
      provided += ok ? 1 : 0;
      wrong += ok == (b <= static_cast<std::size_t>(Surface::kBricksPerTick)) ? 0 : 1;
    }
    CHECK(calls == 0);
    CHECK(wrong == 0);
    CHECK(provided == Surface::kBricksPerTick);
    // One that is up to date costs nothing.
    if (blocks > 35) CHECK(surface.provide(1));
    surface.begin_tick();
    CHECK(surface.provide(grid.brick_count() - 1));
  }
}

TEST_CASE("bone surface: scenes of a grid and an isovalue share one") {
  std::mt19937 rng(kSeed + 4);
  const GridGeometry geometry{.size = {16, 16, 16}, .spacing = Vec3d::Constant(kH), .outside = 0};
  const auto one = random_grid<std::uint8_t>(geometry, rng), other = random_grid<std::uint8_t>(geometry, rng);
  auto a = share_bone_surface(one, 100.0);
  const auto b = share_bone_surface(one, 100.0);
  CHECK(a == b);
  CHECK(a != share_bone_surface(one, 101.0));
  CHECK(a != share_bone_surface(other, 100.0));
  CHECK(&a->grid() == &one);
  CHECK(a->isovalue() == 100);
  const std::weak_ptr<BoneSurface<std::uint8_t>> seen = a;
  a.reset();
  CHECK_FALSE(seen.expired());
  CHECK_THROWS_AS(share_bone_surface(one, std::nan("")), std::invalid_argument);
}

TEST_CASE("bone surface: a point is bone where the interpolant reaches the isovalue; beyond the volume is air") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 5);
  const Vec3d h(2e-4, 3e-4, 5e-4);
  const auto grid = random_grid<std::int16_t>({.size = {20, 16, 13}, .spacing = h, .outside = -30000}, rng);
  BoneSurface<std::int16_t> surface(grid, 0);
  int wrong = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d p = random_point(rng, -3 * h, h.cwiseProduct(Vec3d(23, 19, 16)));
    const double value = interpolate(grid, p);
    wrong += std::abs(value) > 1e-6 && surface.is_bone(p) != (value >= 0) ? 1 : 0;
    // A ball about p is beyond where none of it is over a cell that has bone.
    if (surface.view().is_beyond(p, 1e-3))
      wrong += (p + 9.9e-4 * random_direction(rng)).minCoeff() > -3e-3 && surface.is_bone(p) ? 1 : 0;
  }
  CHECK(wrong == 0);
  CHECK(surface.view().is_beyond(Vec3d(-2e-3, 0, 0), 1e-3));
  CHECK_FALSE(surface.view().is_beyond(Vec3d(-1e-3, 0, 0), 1e-3));
  CHECK(surface.view().voxel() == 5e-4);
}

}  // namespace
