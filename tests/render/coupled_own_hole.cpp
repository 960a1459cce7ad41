// SPDX-License-Identifier: MIT
// The coupled tool fits the hole that it cut, whatever the densities and however long the voxels.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/check_refused.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/voxel/convert.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 5309;
constexpr double kDepth = 5e-3;

struct Rest {
  double behind = 0;  // the device [longest voxels]
  double force = 0;   // [N]
  double wide = 0;    // the hole's mean radius less the burr's [longest voxels]
};

/// Bone below a plane through the middle, which `up` leaves.
template <VoxelDensity Density>
[[nodiscard]] auto block(RasterOptions o, const Vec3d& up, double radius, Random& random, Vec3d& top) {
  const double side = radius + 1.6 * o.spacing.maxCoeff() + 1e-3, deep = kDepth + 1.6 * o.spacing.maxCoeff() + 1.5e-3;
  const Vec3d a = up.unitOrthogonal(), b = up.cross(a);
  Eigen::AlignedBox3d box;
  for (const double h : {-deep, 2.5e-3 + o.spacing.maxCoeff()})
    for (const double x : {-side, side})
      for (const double y : {-side, side}) box.extend(Vec3d(h * up + x * a + y * b));
  for (std::size_t i = 0; i < 3; ++i)
    o.size[i] = static_cast<int>(box.sizes()[static_cast<int>(i)] / o.spacing[static_cast<int>(i)]) + 2;
  top = o.spacing.cwiseProduct(Vec3d(random.uniform(), random.uniform(), random.uniform())) - box.min();
  return rasterise<Density>(HalfSpace{top, up}, o);
}

/// Plunges by kDepth within a second, and rests for as long.
template <VoxelDensity Density, class... Parts>
Rest plunge(VoxelGrid<Density>& bone, double isovalue, const Vec3d& top, const Vec3d& up, double radius,
            const Parts&... parts) {
  constexpr int kTicks = 1000;
  const Burr burr{.tip_radius = radius, .shaft_radius = 0.6 * radius, .shaft_length = 0.04};
  HapticScene scene{bone, isovalue, CoupledToolRenderer{burr, kGains}, parts...};
  const double longest = bone.spacing().maxCoeff();
  Rest out;
  Vec3d tip;
  for (int i = -100; i < 2 * kTicks; ++i) {
    tip = top + (radius - std::min(i, kTicks) * kDepth / kTicks) * up;
    const TickResult r = scene.tick({.X_WT = tool_at(tip, up), .spindle_on = true}, kDt);
    if (i < 2 * kTicks - 100) continue;
    out.force = std::max(out.force, r.wrench.force.norm());
    out.behind = std::max(out.behind, (scene.proxy_pose_W().translation() - tip).norm() / longest);
  }
  // Rays out of the hole's axis, from the ball's centre up.
  constexpr int kRays = 48;
  const Vec3d a = up.unitOrthogonal(), b = up.cross(a);
  for (int n = 0; n < kRays; ++n) {
    const double turn = 2 * kPi * n / kRays;
    const Vec3d from = tip + (1e-4 + n % 8 * 1e-4) * up, way = std::cos(turn) * a + std::sin(turn) * b;
    double r = 0;
    const auto density = [&](const Vec3d& p) {
      return sample(SampleView<Density, double>(bone), Vec3d(p.cwiseQuotient(bone.spacing()) + Vec3d::Ones()));
    };
    while (r < 3 * radius && density(from + r * way) < isovalue) r += 1e-5;
    out.wide += (r - radius) / longest / kRays;
  }
  return out;
}

template <VoxelDensity Density, class Cut = Cutting<>>
void check_mask(double low, double high, double isovalue, const Cut& milling = {}) {
  CAPTURE(kSeed);
  CAPTURE(isovalue);
  Random random(kSeed);
  Figures force, wide;
  for (int n = 0; n < (kSanitized ? 1 : 2); ++n) {
    const Vec3d up = n == 0 ? Vec3d(Vec3d::UnitX()) : random.unit();
    Vec3d top;
    auto bone = block<Density>({.image = Image::kBinary, .contrast = high - low, .air = low}, up, 1.5e-3, random, top);
    const Rest rest = plunge(bone, isovalue, top, up, 1.5e-3, milling);
    force.add(rest.force);
    wide.add(rest.wide);
  }
  MESSAGE("mask of ", low, " and ", high, " at ", isovalue, ": force at rest [N] ", force, ", hole too wide [voxels] ",
          wide);
  CHECK(force.worst() <= 0.032);
  CHECK(wide.worst() <= 0.14);
  CHECK(wide.least() >= 0);
}

/// True if a scene with these densities and parts is refused, as a cut that its tool does not fit.
template <VoxelDensity Density, class... Parts>
bool is_refused(double low, double high, double isovalue, const Parts&... parts) {
  Random random(kSeed);
  Vec3d top;
  auto bone =
      block<Density>({.image = Image::kBinary, .contrast = high - low, .air = low}, Vec3d::UnitZ(), 1e-3, random, top);
  try {
    HapticScene{bone, isovalue, CoupledToolRenderer{kDrill, kGains}, parts...};
  } catch (const std::invalid_argument& e) {
    CHECK(std::string(e.what()).find("converted<") != std::string::npos);
    return true;
  }
  return false;
}

}  // namespace

TEST_CASE("coupled own hole: masks with room for the cut's ramp, isovalues near the densities of air and bone too") {
  check_mask<std::uint8_t>(0, 255, 128);
  check_mask<std::uint8_t>(0, 255, 10);
  check_mask<std::uint8_t>(0, 255, 245);
  check_mask<std::int8_t>(-50, 50, 0);
  check_mask<std::uint16_t>(0, 20, 10);
  check_mask<std::int16_t>(-1000, 1000, 0);
  check_mask<float>(0, 1, 0.5);
  check_mask<float>(0, 1, 0.001);
  check_mask<float>(0, 1, 0.999);
  const Cutting advancing{AdvancingCut{.speed = 20e-3}};
  check_mask<float>(0, 1, 0.001, advancing);
  check_mask<std::uint8_t>(0, 255, 10, advancing);
}

TEST_CASE("coupled own hole: densities that cannot hold a cut are refused, with the way out; others are not") {
  CHECK(is_refused<std::uint8_t>(0, 1, 0.5, Cutting{}));
  CHECK(is_refused<std::uint8_t>(0, 2, 1, Cutting{RateLimitedCut<>{}}));
  CHECK(is_refused<std::int8_t>(0, 1, 0.5, Cutting{AdvancingCut{}}));
  CHECK(is_refused<std::int16_t>(0, 1, 0.5, Cutting{PressureCut{}, CuttingForce(CuttingForce::Options{})}));
  CHECK(is_refused<std::uint8_t>(0, 255, 1, Cutting{}));
  CHECK(is_refused<std::uint8_t>(0, 255, 9.5, Cutting{}));
  CHECK(is_refused<std::uint8_t>(0, 255, 254.5, Cutting{}));
  CHECK(is_refused<std::int16_t>(-1000, 1000, 0, Cutting{GeometricCut{}, {.slope = 2}}));
  CHECK_FALSE(is_refused<std::int16_t>(-1000, 1000, -999.5, Cutting{}));
  CHECK_FALSE(is_refused<std::int16_t>(-1000, 1000, 0, Cutting{GeometricCut{}, {.slope = 10}}));
  CHECK_FALSE(is_refused<std::uint8_t>(0, 1, 0.5));  // nothing cuts
  CHECK_FALSE(is_refused<float>(0, 1, 0.5, Cutting{}));
  CHECK_FALSE(is_refused<std::uint8_t>(0, 255, 30, Cutting{}));
}

TEST_CASE("coupled own hole: a mask of 0 and 1 is drilled after its conversion") {
  CAPTURE(kSeed);
  Random random(kSeed);
  Vec3d top;
  const auto mask = block<std::uint8_t>({.image = Image::kBinary, .contrast = 1}, Vec3d::UnitX(), 1.5e-3, random, top);
  auto wide = converted<std::int16_t>(mask, 1000);
  CHECK(plunge(wide, 500, top, Vec3d::UnitX(), 1.5e-3, Cutting{}).force <= 0.007);
  auto real = converted<float>(mask);
  CHECK(plunge(real, 0.5, top, Vec3d::UnitX(), 1.5e-3, Cutting{}).force <= 0.0071);
}

TEST_CASE("coupled own hole: slices of two and a half and five times the voxels' width, whichever way they lie" *
          doctest::test_suite("long")) {
  CAPTURE(kSeed);
  const auto check = [&](const std::string& name, const Vec3d& spacing, double at_rest, const auto&... parts) {
    Random random(kSeed);
    Figures behind, force;
    for (const double radius : {1.0e-3, 1.5e-3, 2.0e-3})
      for (int way = 0; way < 4; ++way) {
        if (kSanitized && radius > 1.0e-3) continue;
        const Vec3d up = way < 3 ? Vec3d(Vec3d::Unit(way)) : random.unit();
        Vec3d top;
        auto bone =
            block<float>({.spacing = spacing, .blur = 0.7, .contrast = 2000, .air = -1000}, up, radius, random, top);
        const Rest rest = plunge(bone, 0, top, up, radius, parts...);
        behind.add(rest.behind);
        force.add(rest.force);
      }
    MESSAGE(name, ", voxels ", 1e3 * spacing.x(), " x ", 1e3 * spacing.y(), " x ", 1e3 * spacing.z(),
            " mm: behind [longest voxels] ", behind, ", force at rest [N] ", force);
    CHECK(behind.worst() <= 0.3);
    CHECK(force.worst() <= at_rest);
  };
  const CuttingForce law(CuttingForce::Options{.strength = {.soft = -1000, .cortical = 1000}, .force_scale = 0.005});
  check("geometric", {4e-4, 4e-4, 1e-3}, 0.1, Cutting{});
  check("geometric", {4e-4, 4e-4, 2e-3}, 0.3, Cutting{});
  check("geometric", {4e-4, 2e-3, 2e-3}, 0.3, Cutting{});
  check("by pressure", {4e-4, 4e-4, 1e-3}, 0.1, Cutting{PressureCut{}, law});
  check("by pressure", {2e-3, 4e-4, 4e-4}, 0.3, Cutting{PressureCut{}, law});
  check("by pressure", {4e-4, 2e-3, 2e-3}, 0.3, Cutting{PressureCut{}, law});
  check("advancing", {4e-4, 2e-3, 4e-4}, 0.3, Cutting{AdvancingCut{.speed = 20e-3}});
  check("rate", {4e-4, 2e-3, 4e-4}, 0.3, Cutting{{.rate = 2e5}});
}
