// SPDX-License-Identifier: MIT
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/render/coupled/tool_in_bone.hpp>
#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <doctest/doctest.h>

#include <algorithm>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 333;
constexpr double kH = 3e-4;
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.010};

/// Trilinear density at a point by its eight voxels, the outside density beyond the grid.
double density(const VoxelGrid<std::uint8_t>& bone, const Vec3d& p) {
  const Vec3d u = p.cwiseQuotient(bone.spacing());
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    double weight = 1;
    bool inside = true;
    std::array<int, 3> v{};
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      const double floor = std::floor(u[a]), f = u[a] - floor;
      const bool up = (c >> a & 1) != 0;
      v[i] = static_cast<int>(floor) + (up ? 1 : 0);
      weight *= up ? f : 1 - f;
      inside = inside && v[i] >= 0 && v[i] < bone.size()[i];
    }
    sum += weight * static_cast<double>(inside ? bone.at(v[0], v[1], v[2]) : bone.outside());
  }
  return sum;
}

// Bone in crumbs of a voxel and larger: the samples may miss a crumb that the axis meets for less than a voxel.
TEST_CASE("tool in bone: the core's test finds all bone along the axis that is longer than a voxel") {
  CAPTURE(kSeed);
  constexpr int kFine = 20;       // brute force: samples within a spacing
  constexpr double kBand = 1e-6;  // densities as near to the isovalue may be on either side, of 255
  Random random(kSeed);
  std::vector<std::uint8_t> voxels(48 * 48 * 48);
  for (auto& v : voxels) v = random.uniform() < 0.01 ? 255 : 0;
  const VoxelGrid<std::uint8_t> bone({.size = {48, 48, 48}, .spacing = Vec3d::Constant(kH), .outside = 0}, voxels);
  constexpr double kIsovalue = 100;
  BoneSurface<std::uint8_t> surface(bone, kIsovalue);
  const ToolBounds bounds = BallAndShaft(kDrill).bounds();
  const Vec3d middle = 0.5 * 47 * Vec3d::Constant(kH);
  int in_bone = 0, missed = 0, false_alarms = 0;
  for (int i = 0; i < 600; ++i) {
    const Posed X = random_pose(random, middle, 0.008);
    const bool found = is_core_in_bone(surface.view(), bounds, X);
    in_bone += found ? 1 : 0;
    const Vec3d u = X.linear().col(2);
    const double first = bounds.z_low + bounds.core_radius, last = bounds.z_high - bounds.core_radius;
    double run = 0, longest = 0, highest = 0;
    const double step = kH / kFine;
    for (double z = first; z <= last + step / 2; z += step) {
      const double d = density(bone, X.translation() + z * u);
      highest = std::max(highest, d);
      run = d >= kIsovalue + kBand ? run + step : 0;
      longest = std::max(longest, run);
    }
    missed += !found && longest > kH ? 1 : 0;
    // Between fine samples the density rises by less than two contrasts a voxel over half a step.
    false_alarms += found && highest < kIsovalue - 3 * 255.0 / kFine ? 1 : 0;
  }
  CHECK(missed == 0);
  CHECK(false_alarms == 0);
  CHECK(in_bone > 60);
  CHECK(in_bone < 240);
}

TEST_CASE("tool in bone: a tool known to be in the air has no bone within the motion") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  const RasterOptions o{.size = {48, 48, 48}, .spacing = Vec3d::Constant(kH)};
  const HalfSpace plane{o.middle(), random.unit()};
  const auto bone = rasterise<std::uint8_t>(plane, o);
  BoneSurface<std::uint8_t> surface(bone, o.isovalue());
  const BallAndShaft shape(kDrill);
  const ToolBounds bounds = shape.bounds();
  int wrong = 0, by_bounds = 0, near = 0;
  for (int i = 0; i < 4000; ++i) {
    const Posed X = random_pose(random, o.middle(), i % 2 == 0 ? 0.02 : 0.06);
    const double motion = random.uniform(0, 2e-3);
    const Vec3d tip = X.translation(), end = X * Vec3d(0, 0, kDrill.shaft_length);
    // Nearest distance of the drill from the half space: of its ball, or of its shaft's end disc.
    const double slope = (X.linear().transpose() * plane.outward).head<2>().norm();
    const double gap = std::min(plane(tip) - kDrill.tip_radius, plane(end) - kDrill.shaft_radius * slope);
    near += gap < motion ? 1 : 0;
    if (is_known_in_air(surface.view(), bounds, X, motion)) {
      ++by_bounds;
      // The whole drill and its motion lie beyond one face of the volume.
      const Vec3d low = tip.cwiseMin(end) - Vec3d::Constant(kDrill.tip_radius + motion),
                  high = tip.cwiseMax(end) + Vec3d::Constant(kDrill.tip_radius + motion);
      wrong += (high.minCoeff() <= -kH || low.maxCoeff() >= 48 * kH) ? 0 : 1;
    }
  }
  MESSAGE("beyond the grid ", by_bounds, ", near bone ", near);
  CHECK(wrong == 0);
  CHECK(by_bounds > 300);
  CHECK(near > 300);
}

}  // namespace
