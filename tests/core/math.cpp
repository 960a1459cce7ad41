// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "support/raster.hpp"

#include <trephine/core/spatial.hpp>

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

// What must hold: a rotation, takes a to b, and turns by no more than the angle between them.
TEST_CASE_TEMPLATE("rotation_between takes one unit vector to another by the smallest turn", Scalar, float, double) {
  const Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(5e-6) : Scalar(1.1e-14);
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
      CHECK(static_cast<double>(rotation_vector(R).norm()) ==
            within(angle, std::is_same_v<Scalar, float> ? 2.5e-6 : 1e-14));
    }
  }
}

TEST_CASE_TEMPLATE("exponential map: Eigen's rotation about the axis, undone by the logarithm", Scalar, float, double) {
  const Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(2e-6) : Scalar(4e-15);
  CHECK(rotation_from_vector<Scalar>(Vec3<Scalar>::Zero()) == Mat3<Scalar>::Identity());
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const Vec3<Scalar> axis = random.unit().cast<Scalar>().normalized();
    // From 1e-12 to π: small steps of a search, and whole turns.
    const auto angle =
        static_cast<Scalar>(i % 2 == 0 ? random.uniform(0, 3.14159) : std::pow(10, -random.uniform(0, 12)));
    const Mat3<Scalar> R = rotation_from_vector<Scalar>(angle * axis);
    CHECK((R - Eigen::AngleAxis<Scalar>(angle, axis).toRotationMatrix()).norm() <= tolerance);
    const Vec3<Scalar> back = rotation_vector(R);
    CHECK((back - angle * axis).norm() <= (angle > Scalar(3) ? 200 : 1) * tolerance);
    CHECK((transposed(R) - R.transpose()).norm() == 0);
  }
}

TEST_CASE("poses and spatial vectors: the same as Eigen's expressions") {
  Random random(7);
  const auto pose = [&] {
    const Mat3d R = rotation_from_vector<double>(random.uniform(0, 3) * random.unit());
    return make_pose<double>(R, random.uniform(0, 2) * random.unit());
  };
  for (int i = 0; i < 200; ++i) {
    const Posed a = pose(), b = pose();
    CHECK((inverse(a).matrix() - a.inverse().matrix()).norm() <= 1e-15);
    CHECK((compose(a, b).matrix() - (a * b).matrix()).norm() <= 1.5e-15);
    CHECK((compose(inverse(a), a).matrix() - Posed::Identity().matrix()).norm() <= 4e-15);
    CHECK((moved(a, motion_to(a, b)).matrix() - b.matrix()).norm() <= 4e-15);
    CHECK(to_float(a.translation()) == a.translation().cast<float>());

    const Vec6d v = spatial(a.translation(), b.translation());
    CHECK((v.head<3>() == a.translation() && v.tail<3>() == b.translation()));
    CHECK((linear_part(v) == a.translation() && angular_part(v) == b.translation()));
    Vec6d force = v;
    clear_angular(force);
    CHECK(force == spatial(a.translation(), Vec3d::Zero()));
    Mat6d m = v * v.transpose(), expected = m;
    add_block(m, 3, i % 4, a.linear());
    expected.block<3, 3>(3, i % 4) += a.linear();
    CHECK(m == expected);
    add_to_diagonal(m, i % 4, 2.5);
    expected.block<3, 3>(i % 4, i % 4).diagonal().array() += 2.5;
    CHECK(m == expected);
    clear_angular(m);
    expected.bottomRows<3>().setZero();
    expected.rightCols<3>().setZero();
    CHECK(m == expected);
  }
}

TEST_CASE("rotation_defect: the largest entry of |RᵀR − I|, infinite for what is not finite") {
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    const Mat3d R = rotation_from_vector<double>(random.uniform(0, 3) * random.unit());
    CHECK(rotation_defect(R) <= 4e-15);
    CHECK(rotation_defect(-R) <= 4e-15);
    Mat3d stretched = R;
    stretched(i % 3, (i / 3) % 3) += random.uniform(-1, 1);
    const double off = (stretched.transpose() * stretched - Mat3d::Identity()).cwiseAbs().maxCoeff();
    CHECK(rotation_defect(stretched) == near(off, 1e-14));
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
      Mat3d broken = R;
      broken(i % 3, (i / 3) % 3) = bad;
      CHECK(std::isinf(rotation_defect(broken)));
    }
  }
}

}  // namespace
