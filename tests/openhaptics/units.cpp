// SPDX-License-Identifier: MIT
#include "openhaptics_units.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

using trephine::test::near;

using namespace openhaptics;
using trephine::Vec3d;

TEST_CASE("OpenHaptics units: a transform is stored by columns, in millimetres") {
  // A quarter turn about z: x goes to y, y to -x. Translation 10, -20, 30 mm.
  const std::array<double, 16> m{0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 10, -20, 30, 1};
  const trephine::Posed X = pose_from_transform(m);
  CHECK((X * Vec3d(1, 0, 0) - Vec3d(0.010, 0.980, 0.030)).norm() < 1e-15);
  CHECK((X * Vec3d(0, 1, 0) - Vec3d(-0.990, -0.020, 0.030)).norm() < 1e-15);
  CHECK((X * Vec3d(0, 0, 1) - Vec3d(0.010, -0.020, 1.030)).norm() < 1e-15);
}

TEST_CASE("OpenHaptics units: newtons stay, newton metres become thousandths, newtons a millimetre become a metre's") {
  CHECK(force_to_driver(Vec3d(1, -2, 3)) == std::array<double, 3>{1, -2, 3});
  CHECK(torque_to_driver(Vec3d(0.1, -0.25, 2)) == std::array<double, 3>{100, -250, 2000});
  CHECK(torque_from_driver(188) == near(0.188));
  CHECK(stiffness_from_driver(2.35) == near(2350));
}
