// SPDX-License-Identifier: MIT
// Gains that single precision cannot compute with are refused: the virtual tool stays somewhere.
#include "support/raster.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <doctest/doctest.h>

#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;

TEST_CASE("coupled options: gains are positive and no more than can be computed with") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, 1e13, 1e300, nan, inf}) {
    CHECK_THROWS_WITH_AS((CoupledOptions{.stiffness = bad}.validate()),
                         doctest::Contains("trephine::CoupledOptions: stiffness must be > 0 and at most 1e12 N/m"),
                         std::invalid_argument);
    if (bad != inf)  // that one is a meaning of its own
      CHECK_THROWS_AS((CoupledOptions{.rotational_stiffness = bad}.validate()), std::invalid_argument);
    CHECK_THROWS_AS((CoupledOptions{.force = bad}.validate()), std::invalid_argument);
    if (bad != 0)  // likewise: a device without torque
      CHECK_THROWS_AS((CoupledOptions{.torque = bad}.validate()), std::invalid_argument);
  }
  for (const double bad : {0.0, -1.0, nan})
    CHECK_THROWS_WITH_AS((CoupledOptions{.release = bad}.validate()),
                         doctest::Contains("trephine::CoupledOptions: release must be > 0 N/s"), std::invalid_argument);
  CHECK_NOTHROW(CoupledOptions{.release = inf}.validate());
  CHECK_NOTHROW(CoupledOptions{.torque = 0}.validate());
}

TEST_CASE("coupled options: with the greatest and least gains the virtual tool has a pose, in bone and free") {
  RasterOptions o{.size = {24, 24, 24}};
  for (const double k : {1e12, 1.0, 1e-9}) {
    auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
    const Burr burr{.tip_radius = 1e-3, .shaft_radius = 5e-4, .shaft_length = 5e-3};
    HapticScene scene{
        grid, o.isovalue(),
        CoupledToolRenderer(burr, CoupledOptions{.stiffness = k, .rotational_stiffness = k, .force = k, .torque = k}),
        DeviceLimits{3.3, 0.1}};
    for (int i = 0; i < 60; ++i) {
      Posed X = Posed::Identity();
      X.translation() = o.middle() + Vec3d(0, 0, 2e-3 - 1e-4 * i);
      const TickResult r = scene.tick({.X_WT = X}, 1e-3);
      CAPTURE(k);
      REQUIRE(is_finite(r.wrench));
      REQUIRE(scene.proxy_pose_W().matrix().allFinite());
    }
  }
}

}  // namespace
