// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/poses.hpp"

#include <trephine/render/coupled/virtual_coupling.hpp>

#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>

#include <cmath>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 331;
constexpr double kArm = 0.01;  // [m]: rotations count as the motion of a point at this distance

/// 800 N/m up to 3.3 N, 0.3 N·m/rad up to 0.1 N·m.
VirtualCoupling coupling(bool solves_rotation) {
  constexpr double kYield = 1e-4;
  const BallOnPlane contact{3.3 / BallOnPlane{1, 1.5e-3, 5e-5}.force(kYield), 1.5e-3, 5e-5};
  return {CompensatedSpring(800, contact, kYield), {0.3, 0.1}, solves_rotation};
}

Vec6d random_motion(Random& random) {
  Vec6d motion;
  motion << random.unit(), random.unit() / kArm;
  return motion / 2;
}

// Error of central differences over 1e-7 m: rounding of 1e-16 J over it, and the law's third derivative.
TEST_CASE("virtual coupling: the wrench is the energy's descent, the Hessian its second derivative") {
  CAPTURE(kSeed);
  constexpr double kStep = 1e-7, kFirst = 3e-10, kSecond = 2.5e-10;
  Random random(kSeed);
  const VirtualCoupling c = coupling(true);
  Figures first, second;
  for (int i = 0; i < 200; ++i) {
    const Posed X = random_pose(random, Vec3d::Zero(), 0.1);
    // Below saturation, where the Hessian is the exact one.
    const Posed X_device = moved(X, (Vec6d() << random.arrow(4e-4, 3e-3), random.arrow(0.02, 0.3)).finished());
    const PoseError error = c.evaluate(X, X_device);
    Mat6d H = Mat6d::Zero(), geometric_stiffness = Mat6d::Zero();
    c.add_hessian(error, H, geometric_stiffness);
    H += geometric_stiffness;
    const Vec6d motion = random_motion(random);
    const PoseError before = c.evaluate(moved(X, -kStep * motion), X_device),
                    after = c.evaluate(moved(X, kStep * motion), X_device);
    const double size = VirtualCoupling::wrench(error).norm();
    first.add(std::abs((after.energy - before.energy) / (2 * kStep) + VirtualCoupling::wrench(error).dot(motion)) /
              size);
    const double change = (VirtualCoupling::wrench(before) - VirtualCoupling::wrench(after)).dot(motion) / (2 * kStep);
    second.add(std::abs(change / motion.dot(H * motion) - 1));
  }
  MESSAGE("wrench off by ", first, "; Hessian off by ", second);
  CHECK(first.worst() <= kFirst);
  CHECK(second.worst() <= kSecond);
}

TEST_CASE("virtual coupling: the Gauss-Newton part is positive definite at any pose error, saturated or not") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  const VirtualCoupling c = coupling(true);
  int saturated = 0, wrong = 0;
  for (int i = 0; i < 300; ++i) {
    const Posed X = random_pose(random, Vec3d::Zero(), 0.1);
    const Posed X_device = moved(X, (Vec6d() << random.arrow(0, 0.02), random.arrow(0, 2)).finished());
    const PoseError error = c.evaluate(X, X_device);
    saturated += error.force.magnitude == c.translation_spring.max_force() ? 1 : 0;
    wrong += error.force.magnitude <= c.translation_spring.max_force() && error.torque.magnitude <= 0.1 ? 0 : 1;
    Mat6d H = Mat6d::Zero(), geometric_stiffness = Mat6d::Zero();
    c.add_hessian(error, H, geometric_stiffness);
    wrong += Eigen::SelfAdjointEigenSolver<Mat6d>(H).eigenvalues().minCoeff() > 0 ? 0 : 1;
  }
  CHECK(wrong == 0);
  CHECK(saturated > 50);
  CHECK(saturated < 250);
}

TEST_CASE("virtual coupling: no pose error gives no wrench, and a fixed rotation no torque") {
  Random random(kSeed + 2);
  const Posed X = random_pose(random, Vec3d::Zero(), 0.1);
  CHECK(VirtualCoupling::wrench(coupling(true).evaluate(X, X)) == Vec6d::Zero());
  CHECK(coupling(true).evaluate(X, X).energy == 0);
  const Posed X_device = moved(X, (Vec6d() << 1e-3 * random.unit(), 0.2 * random.unit()).finished());
  const PoseError error = coupling(false).evaluate(X, X_device);
  CHECK(VirtualCoupling::wrench(error).tail<3>() == Vec3d::Zero());
  CHECK(VirtualCoupling::wrench(error).head<3>().norm() == near(error.force.magnitude));
  CHECK(error.energy == error.force.energy);
}

}  // namespace
