// SPDX-License-Identifier: MIT
#include <trephine/core/rotation.hpp>
#include <trephine/stage/motion.hpp>

#include "fakes.hpp"

using namespace trephine;
using namespace trephine::test;

TEST_CASE("usable poses") {
  CHECK(is_usable_pose(Posed::Identity()));
  CHECK(is_usable_pose(at(999, 0, 0)));
  CHECK(is_usable_pose(at(5e-324, -5e-324, 0)));
  CHECK(is_usable_pose(turned({1, 2, 3}, {1, 1, 1})));
  CHECK(!is_usable_pose(at(1000, 0, 0)));
  for (const double bad : {kNaN, kInf, -kInf, 1e30, -1e30, 1e300}) {
    for (int i = 0; i < 3; ++i) {
      auto X = turned({1, 2, 3}, {1, 1, 1});
      X.translation()[i] = bad;
      CHECK(!is_usable_pose(X));
      for (int j = 0; j < 3; ++j) {
        auto Y = turned({1, 2, 3}, {1, 1, 1});
        Y.linear()(i, j) = bad;
        CHECK(!is_usable_pose(Y));
      }
    }
  }
}

TEST_CASE("usable rotations") {
  const auto with = [](const Mat3d& R) { return make_pose<double>(R, Vec3d::Zero()); };
  CHECK(is_usable_pose(with(1.0004 * Mat3d::Identity())));  // RᵀR − I is 8e-4
  CHECK(!is_usable_pose(with(1.0006 * Mat3d::Identity())));
  CHECK(!is_usable_pose(with(-Mat3d::Identity())));
  CHECK(!is_usable_pose(with(Vec3d(1, 1, -1).asDiagonal())));
  CHECK(!is_usable_pose(with(Mat3d::Zero())));
  CHECK(!is_usable_pose(with(1e-310 * Mat3d::Identity())));
  Mat3d shear = Mat3d::Identity();
  shear(0, 1) = 2e-3;
  CHECK(!is_usable_pose(with(shear)));
  const Eigen::Matrix3f rounded = rotation_from_vector<double>({0.3, -2, 1}).cast<float>();
  CHECK(is_usable_pose(with(rounded.cast<double>())));
}

TEST_CASE("clamped dt") {
  for (const double bad : {kNaN, -kInf, -1.0, 0.0, 1e-9, 9.9e-6}) {
    CHECK(clamped_dt(bad) == kShortestDt);
    CHECK(!is_usable_dt(bad));
  }
  for (const double bad : {10.0, kInf, 0.1001}) {
    CHECK(clamped_dt(bad) == kLongestDt);
    CHECK(!is_usable_dt(bad));
  }
  for (const double good : {kShortestDt, 1e-3, kLongestDt}) {
    CHECK(clamped_dt(good) == good);
    CHECK(is_usable_dt(good));
  }
}

TEST_CASE("twist of two poses: the exponential of it leads from one to the other") {
  const auto A = turned({0.4, -1, 2}, {0.1, 0.2, 0.3});
  const Vec3d w(3, -2, 1);
  const auto B = make_pose<double>(rotation_from_vector<double>(w * kTick) * A.linear(),
                                   Vec3d(A.translation() + Vec3d(1, 2, -3) * kTick));
  const Twist v = twist_between(A, B, kTick);
  CHECK((v.linear - Vec3d(1, 2, -3)).norm() < 1e-12);
  CHECK((v.angular - w).norm() < 1e-11);
  const Twist still = twist_between(A, A, kShortestDt);
  CHECK(still.linear.norm() == 0);
  CHECK(still.angular.norm() < 1e-10);
}

TEST_CASE("relative pose keeps sub-micrometre accuracy far from the world's origin") {
  const auto X_WG = turned({0.3, 0.2, -1}, {900, -100, 50});
  const auto X_GT = turned({1, 0, 2}, {0.01, 0.02, 0.03});
  const Posed found = relative_pose(X_WG, X_WG * X_GT);
  CHECK((found.translation() - X_GT.translation()).norm() < 1e-12);
  CHECK((found.linear() - X_GT.linear()).norm() < 1e-14);
  // A step that doubles hold exactly at that distance comes out to its own rounding, not to that of the distance.
  const Vec3d step(0x1p-20, -0x1p-21, 0x1p-22);
  const auto near = make_pose<double>(X_WG.linear(), Vec3d(X_WG.translation() + step));
  CHECK((relative_pose(X_WG, near).translation() - X_WG.linear().transpose() * step).norm() < 1e-20);
}

TEST_CASE("a jump is what no hand moves or turns in a tick") {
  const Posed here = turned(Vec3d(0.3, -0.2, 1), Vec3d(0.1, 0.2, 0.3));
  const auto jumps = [&](double shift, double turn, double dt) {
    const Vec3d along = Vec3d(2, -1, 2) / 3;
    const Mat3d R = rotation_from_vector(Vec3d(turn * along)) * here.linear();
    return is_jump(here, make_pose<double>(R, here.translation() + shift * along), dt);
  };
  for (const double dt : {1e-3, 4e-3}) {
    CHECK_FALSE(jumps(0.99 * kHandSpeed * dt, 0, dt));
    CHECK(jumps(1.01 * kHandSpeed * dt, 0, dt));
    CHECK_FALSE(jumps(0, 0.99 * kHandTurn * dt, dt));
    CHECK(jumps(0, 1.01 * kHandTurn * dt, dt));
  }
}
