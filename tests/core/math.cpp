// SPDX-License-Identifier: MIT
#include "support/raster.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

// What must hold: a rotation, takes a to b, and turns by no more than the angle between them.
TEST_CASE_TEMPLATE("rotation_between takes one unit vector to another by the smallest turn", Scalar, float, double) {
  const Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(2e-5) : Scalar(1e-12);
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const Vec3<Scalar> a = random.unit().cast<Scalar>().normalized();
    Vec3<Scalar> b = random.unit().cast<Scalar>().normalized();
    if (i % 4 == 1) b = (-a + static_cast<Scalar>(std::pow(10, -random.uniform(0, 12))) * b).normalized();
    if (i % 4 == 2) b = (a + static_cast<Scalar>(std::pow(10, -random.uniform(0, 12))) * b).normalized();
    if (i % 4 == 3) b = i % 8 == 3 ? a : Vec3<Scalar>(-a);
    const Mat3<Scalar> R = rotation_between<Scalar>(a, b);
    CHECK((R * a - b).norm() <= tolerance);
    CHECK((R.transpose() * R - Mat3<Scalar>::Identity()).norm() <= tolerance);
    CHECK(R.determinant() > 0);
    // Where the vectors are nearly opposite any axis is as good.
    if (a.dot(b) > Scalar(-0.99)) {
      const double angle = std::atan2(static_cast<double>(a.cross(b).norm()), static_cast<double>(a.dot(b)));
      CHECK(static_cast<double>(rotation_vector(R).norm()) == doctest::Approx(angle).epsilon(1e-3).scale(1));
    }
  }
}

}  // namespace
