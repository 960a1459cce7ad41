// SPDX-License-Identifier: MIT
// The bone that a cut says it removed against the volume that the isosurface lost.
#include "support/figures.hpp"
#include "support/isosurface_volume.hpp"
#include "support/near.hpp"
#include "support/raster.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>

#include <doctest/doctest.h>

#include <string>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 1903;
constexpr double kVoxel = 3e-4;
constexpr double kRadius = 5 * kVoxel;
constexpr double kBound = 0.005;
constexpr std::array kBlurs{0.5, 0.7, 1.0};

/// What a density type's scanner gives: air, bone.
template <VoxelDensity Density>
constexpr double kAir = sizeof(Density) == 1 ? 10 : -1000;
template <VoxelDensity Density>
constexpr double kBone = sizeof(Density) == 1 ? 245 : 1700;

/// Isovalue at this part of the contrast.
template <VoxelDensity Density>
double isovalue(double part) {
  return kAir<Density> + part * (kBone<Density> - kAir<Density>);
}

/// A half space through `p` [voxels], blurred by a Gaussian of `sigma` voxels.
template <VoxelDensity Density>
VoxelGrid<Density> face(int size, const Vec3d& p, const Vec3d& normal, double sigma) {
  return make_grid<Density>(
      {.size = {size, size, size}, .spacing = Vec3d::Constant(kVoxel), .outside = kAir<Density>},
      [&](int i, int j, int k) {
        return nearest_density<Density>(blurred(kAir<Density>, kBone<Density>, normal.dot(Vec3d(i, j, k) - p) / sigma));
      });
}

/// The first three along the axes, others anywhere.
Vec3d normal_of(int trial, Random& random) { return trial < 3 ? Vec3d(Vec3d::Unit(trial)) : random.unit(); }
Vec3d near_middle(int size, Random& random) {
  return Vec3d::Constant(0.5 * size - 0.5) +
         Vec3d{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
}

}  // namespace

TEST_CASE_TEMPLATE("removed volume: shallow cuts of scanned faces", Density, std::uint8_t, std::int16_t) {
  CAPTURE(kSeed);
  constexpr int kSize = 20, kTrials = 15;
  Random random(kSeed);
  for (const double part : {0.5, 0.3})
    for (const double sigma : kBlurs) {
      Figures off;
      for (int trial = 0; trial < kTrials; ++trial)
        for (const double depth : {0.3, 1.0, 2.5}) {
          const Vec3d n = normal_of(trial, random), p = near_middle(kSize, random);
          auto grid = face<Density>(kSize, p, n, sigma);
          const double iso = isovalue<Density>(part);
          const LostVolume<Density> lost(grid, iso);
          const Vec3d way = 4 * n.unitOrthogonal();
          const Vec3d from = p + (5 - depth) * n - way / 2;
          double told = 0;
          constexpr int kTicks = 4;
          for (int t = 0; t < kTicks; ++t)
            told += carve(grid, iso,
                          SphereCutter(kVoxel * (from + t * way / kTicks), kVoxel * (from + (t + 1) * way / kTicks),
                                       kRadius, t > 0));
          const double truth = lost.mm3();
          if (truth > 0) off.add(std::abs(told / truth - 1));
        }
      CHECK(off.worst() <= kBound);
      MESSAGE("isovalue at ", part, ", blur ", sigma, ": off by ", off.median(), ", worst ", off.worst());
    }
}

TEST_CASE_TEMPLATE("removed volume: plunges, with drill bits too", Density, std::uint8_t, std::int16_t) {
  CAPTURE(kSeed);
  constexpr int kSize = 28;
  Random random(kSeed + 1);
  const double iso = isovalue<Density>(0.5);
  Figures off, off_with_bits;
  for (int trial = 0; trial < 9; ++trial) {
    const Vec3d n = normal_of(trial, random), p = near_middle(kSize, random) + 6 * n;
    auto grid = face<Density>(kSize, p, n, kBlurs[static_cast<std::size_t>(trial % 3)]);
    const LostVolume<Density> lost(grid, iso);
    Cutting milling;
    Cutting bit{GeometricCut{}, {}, DrillBit{.radius = 3 * kVoxel, .length = 20 * kVoxel}};
    const Mat3d R = Quatd::FromTwoVectors(Vec3d::UnitZ(), n).toRotationMatrix();
    const CutAllowance on{.dt = 1e-3, .force_N = 2};
    double told = 0, told_by_bit = 0;
    const auto plunge = [&](auto& mill, double& sum, const Vec3d& aside) {
      Posed X = make_pose<double>(R, kVoxel * (p + aside + 6 * n));
      for (int t = 0; t < 60; ++t) {
        Posed next = X;
        next.translation() -= 0.2 * kVoxel * n;
        sum += mill.carve(grid, iso, X, next, Burr{.tip_radius = kRadius}, on);
        X = next;
      }
    };
    plunge(milling, told, Vec3d::Zero());
    off.add(std::abs(told / lost.mm3() - 1));
    const LostVolume<Density> lost_by_bit(grid, iso);
    plunge(bit, told_by_bit, 4 * n.unitOrthogonal());
    off_with_bits.add(std::abs(told_by_bit / lost_by_bit.mm3() - 1));
  }
  // A bit's sweep is a sequence of still poses.
  CHECK(off.worst() <= 6e-5);
  CHECK(off_with_bits.worst() <= 1.8e-3);
  MESSAGE("ball: off by ", off.median(), ", worst ", off.worst(), "; bit ", off_with_bits.median(), ", ",
          off_with_bits.worst());
}

TEST_CASE_TEMPLATE("removed volume: cuts in time, from the first ticks on", Density, std::uint8_t, std::int16_t) {
  CAPTURE(kSeed);
  constexpr int kSize = 20;
  Random random(kSeed + 2);
  const double iso = isovalue<Density>(0.5);
  const auto check = [&](const std::string& name, const auto& policy) {
    Figures off;
    for (const double sigma : kBlurs)
      for (int trial = 0; trial < 6; ++trial) {
        const Vec3d n = normal_of(trial, random), p = near_middle(kSize, random);
        auto grid = face<Density>(kSize, p, n, sigma);
        const LostVolume<Density> lost(grid, iso);
        const Vec3d at = kVoxel * (p + 3 * n);
        double told = 0;
        for (std::uint32_t t = 0; t < 200; ++t) {
          told += carve(grid, iso, SphereCutter(at, at, kRadius), policy, {.dt = 1e-3, .tick = t});
          if (t == 49 || t == 199) off.add(std::abs(told / lost.mm3() - 1));
        }
      }
    CHECK(off.worst() <= kBound);
    MESSAGE(name, ": off by ", off.median(), ", worst ", off.worst());
  };
  check("at a speed", AdvancingCut{.speed = 2e-3});
  check("by a rate", RateLimitedCut<>{.rate = 3 * (kBone<Density> - kAir<Density>)});
}

TEST_CASE_TEMPLATE("removed volume: noisy faces, shallow cuts and cuts in time to and fro", Density, std::uint8_t,
                   std::int16_t) {
  CAPTURE(kSeed);
  constexpr int kSize = 20;
  Random random(kSeed + 4);
  const double iso = isovalue<Density>(0.5);
  const auto check = [&](const std::string& name, const auto& policy, double noise, int ticks) {
    Figures off;
    for (int trial = 0; trial < 6; ++trial)
      for (const double depth : {0.3, 1.0, 2.5}) {
        const Vec3d n = normal_of(trial, random), p = near_middle(kSize, random);
        auto grid = make_grid<Density>(
            {.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = kAir<Density>},
            [&](int i, int j, int k) {
              const double v = blurred(kAir<Density>, kBone<Density>, n.dot(Vec3d(i, j, k) - p) / 0.7);
              return nearest_density<Density>(v + noise * (kBone<Density> - kAir<Density>)*random.normal());
            });
        const LostVolume<Density> lost(grid, iso);
        const Vec3d way = 4 * n.unitOrthogonal(), from = p + (5 - depth) * n - way / 2;
        Cutting milling{policy};
        const auto at = [&](int t) {
          const double s = std::abs(std::fmod(t * 0.25, 2.0) - 1);
          return make_pose<double>(Mat3d::Identity(), kVoxel * (from + s * way));
        };
        double told = 0;
        for (int t = 0; t < ticks; ++t)
          told += milling.carve(grid, iso, at(t), at(t + 1), Burr{.tip_radius = kRadius}, {.dt = 1e-3, .force_N = 2});
        const double truth = lost.mm3();
        if (truth > 0) off.add(std::abs(told / truth - 1));
      }
    CHECK(off.worst() <= kBound);
    MESSAGE(name, ", noise ", noise, ": off by ", off.median(), ", worst ", off.worst());
  };
  for (const double noise : {0.02, 0.05}) {
    check("at once", GeometricCut{}, noise, 8);
    check("at a speed", AdvancingCut{.speed = 2e-3}, noise, 60);
    check("by a rate", RateLimitedCut<>{.rate = 3 * (kBone<Density> - kAir<Density>)}, noise, 60);
  }
}

TEST_CASE("removed volume: exact on planes, zero without bone, never negative") {
  // Half of a float grid's cells lie in a plane's half space, whatever its direction, up to the cells that the plane
  // leaves by their ends at the grid's sides.
  Random random(kSeed + 3);
  constexpr int kSize = 12;
  for (int trial = 0; trial < 40; ++trial) {
    const Vec3d n = normal_of(trial, random);
    const auto grid = make_grid<float>(
        {.size = {kSize, kSize, kSize}, .spacing = Vec3d(1e-4, 2e-4, 3e-4), .outside = 0},
        [&](int i, int j, int k) { return 40 + n.dot(Vec3d(i, j, k) - Vec3d::Constant(0.5 * kSize - 0.5)); });
    BoneVolume<float> volume(grid, 40);
    for (int k = 0; k < kSize - 1; ++k)
      for (int j = 0; j < kSize - 1; ++j) volume.add_row(j, k, 0, kSize - 2);
    const double cells = std::pow(kSize - 1, 3);
    CHECK(volume.cells() == near(cells / 2, 1e-8));
    for (const double iso : {-1.0, 0.0, 80.0, 1e9}) {
      BoneVolume<float> all(grid, iso);
      for (int k = 0; k < kSize - 1; ++k)
        for (int j = 0; j < kSize - 1; ++j) all.add_row(j, k, 0, kSize - 2);
      CHECK(all.cells() == (iso > 40 ? 0 : cells));
    }
  }
  // Beyond the type's range nothing is bone, or all.
  const auto bytes = make_grid<std::uint8_t>({.size = {5, 5, 5}, .spacing = Vec3d::Constant(1e-3), .outside = 255},
                                             [](int, int, int) { return 255; });
  const auto row = [&](double iso) {
    BoneVolume<std::uint8_t> volume(bytes, iso);
    volume.add_row(1, 1, -1, 4);
    return volume.cells();
  };
  CHECK(row(255.5) == 0);
  CHECK(row(255) == 6);  // a cell at the isovalue throughout is bone
  CHECK(row(254.5) == 6);
  CHECK(row(-1e30) == 6);
}
