// SPDX-License-Identifier: MIT
// Surface's force has no step where the tool moves by micrometres, and bone that is flat up to its edge has the law.
#include "render/render_helpers.hpp"
#include "support/figures.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 4127;
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.009};
using Tool = ToolDiscretization<SurfaceCounts, float>;

/// Largest change of the force [N] on ways of 1.2 mm in steps of 3.7 µm, on which the shaft passes `at`, in a shape
/// that `make(random, at, axis)` returns.
template <class Make>
Figures steps(Make&& make) {
  constexpr double kStep = 3.7e-6, kHalfWay = 6e-4;
  Random random(kSeed);
  Figures worst;
  for (int n = 0; n < 10; ++n) {
    const RasterOptions o{.size = {70, 70, 70}, .blur = 0.7};
    const Vec3d at = o.middle() + kVoxel * random.arrow(), axis = random.unit();
    const auto grid = rasterise<std::int16_t>(make(random, at, axis), o);
    const auto field = field_of<float>(grid, o);
    for (int path = 0; path < 4; ++path) {
      const Vec3d along = (axis.unitOrthogonal() + 0.35 * random.arrow()).normalized(), way = random.unit();
      const Vec3d middle = at + 5e-4 * random.arrow() - random.uniform(0.0016, 0.008) * along;
      SurfaceApproxRenderer renderer{Tool(kDrill, {.slices = 28}), SurfaceOptions{.stiffness = 800}};
      Vec3d before = Vec3d::Zero();
      double most = 0;
      for (double s = -kHalfWay; s < kHalfWay; s += kStep) {
        const Vec3d force = in_double(render_at(renderer, field, tool_at(middle + s * way, along)).wrench).force;
        if (s == -kHalfWay &&
            std::any_of(renderer.groups().begin(), renderer.groups().end(), [](const auto& g) { return g.deep; }))
          break;  // no history
        if (s > -kHalfWay + kStep) most = std::max(most, (force - before).norm());
        before = force;
      }
      worst.add(most);
    }
  }
  return worst;
}

TEST_CASE("Surface: a shaft in the neck between two balls, and on one, has no steps") {
  CAPTURE(kSeed);
  // 3.7 µm at the tip's largest stiffness are .012 N, and some slices add to it.
  constexpr double kMax = 0.03;
  const auto neck = [](Random& random, const Vec3d& at, const Vec3d& axis) {
    const double gap = kDrill.shaft_radius + random.uniform(-4.5e-4, 1e-4);
    const double a = random.uniform(2e-3, 5e-3), b = random.uniform(2e-3, 5e-3);
    const Ball upper{at + (a + gap) * axis, a}, lower{at - (b + gap) * axis, b};
    return [=](const Vec3d& p) { return std::min(upper(p), lower(p)); };
  };
  const auto ball = [](Random& random, const Vec3d& at, const Vec3d& axis) {
    const double radius = random.uniform(2e-3, 5e-3);
    return Ball{at - radius * axis, radius};
  };
  const Figures in_neck = steps(neck), on_ball = steps(ball);
  MESSAGE("force's steps [N]: in the neck ", in_neck, "; on a ball ", on_ball);
  CHECK(in_neck.worst() <= kMax);
  CHECK(on_ball.worst() <= kMax);
}

/// The force [N] on a mask at the isovalue of its bone, and a little below.
template <class Density, class Scalar>
void check_plateau(double air, double contrast) {
  // The two isosurfaces differ by some thousandths of a voxel, and by more where they cut a mask's corners.
  constexpr double kBelow = 0.002, kMax = 0.05;
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  Figures off;
  for (int n = 0; n < 6; ++n) {
    const RasterOptions o{.size = {50, 50, 50}, .image = Image::kBinary, .contrast = contrast, .air = air};
    const Vec3d at = o.middle() + kVoxel * random.arrow(), normal = random.unit();
    const auto grid = rasterise<Density>(Ball{at - 5e-3 * normal, 5e-3}, o);
    const auto force_at = [&](double isovalue) {
      const DensityField<Density, Scalar> field(grid, isovalue);
      SurfaceApproxRenderer<Scalar> renderer{ToolDiscretization<SurfaceCounts, Scalar>(kDrill, {.slices = 10})};
      return Vec3d(in_double(render_at(renderer, field, tool_at(at + 5e-4 * normal, normal)).wrench).force);
    };
    const Vec3d law = force_at(air + (1 - kBelow) * contrast);
    off.add((force_at(static_cast<double>(static_cast<Density>(air + contrast))) - law).norm() / law.norm());
  }
  MESSAGE("force off by ", off);
  CHECK(off.worst() <= kMax);
}

TEST_CASE_TEMPLATE("Surface: bone that is flat at the isovalue has the law", Scalar, float, double) {
  check_plateau<std::int8_t, Scalar>(-50, 100);
  check_plateau<std::uint8_t, Scalar>(0, 1);
  check_plateau<std::int16_t, Scalar>(-1000, 2200);
  check_plateau<std::uint16_t, Scalar>(0, 65535);
  check_plateau<float, Scalar>(0.7, 0.1);
}

}  // namespace
