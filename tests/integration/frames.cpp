// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "integration/scenes.hpp"

#include <string>
#include <utility>

using namespace trephine;
using namespace trephine::test;

namespace {

/// The same drilling in a grid that stands elsewhere, turned: the wrench must turn along, the tool's path being given
/// in the grid. Nothing else changes, so the only difference is rounding of poses.
template <class R>
void turn_everything(R renderer, double tolerance, const std::string& name) {
  CAPTURE(name);
  auto bone = make_block<std::uint8_t>();
  auto moved = make_block<std::uint8_t>();
  const Posed X_WG = make_pose<double>(rotation_from_vector(Vec3d(0.7, -1.1, 0.4)), Vec3d(1.5, -2.0, 0.8));
  moved.set_X_WG(X_WG);
  HapticScene here{bone, kIsovalue, renderer};
  HapticScene there{moved, kIsovalue, std::move(renderer)};
  double most = 0;
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const double t = 1e-3 * i;
    const Posed X_GT = drilling_pose(t);
    const TickResult a = here.tick({.X_WT = X_GT}, 1e-3);
    const TickResult b = there.tick({.X_WT = X_WG * X_GT}, 1e-3);
    const Wrenchd turned = a.wrench.rotated(X_WG.linear());
    most = std::max(most, a.wrench.force.norm());
    worst = std::max(worst, (turned.force - b.wrench.force).norm());
    CHECK(a.status == b.status);
  }
  CHECK(most > 0.5);
  MESSAGE(name, ": largest difference ", worst / most, " of the largest force");
  CHECK(worst <= tolerance * most);
}

}  // namespace

TEST_CASE("a grid metres away and turned: the wrench is the same, turned along") {
  // Poses come in double and are reduced to the grid's frame before single precision is used: what is left is rounding
  // in double, by which a number in single precision is hardly ever another.
  constexpr double kDouble = 3e-13, kSingle = 1e-6;
  turn_everything(make_line<double>(), kDouble, "line, double");
  turn_everything(make_line<float>(), kSingle, "line, float");
  turn_everything(make_surface<double>(), kDouble, "surface, double");
  turn_everything(make_surface<float>(), kSingle, "surface, float");
}
