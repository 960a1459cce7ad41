// SPDX-License-Identifier: MIT
// Registration against virtual work: by finite displacements of the hand, not by its own formulas.
#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/device/registration.hpp>

#include "support/near.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using test::near;

struct Random {
  std::mt19937 engine{20240611};
  double number(double size) { return std::uniform_real_distribution<double>(-size, size)(engine); }
  Vec3d vector(double size) { return {number(size), number(size), number(size)}; }
  Posed pose(double size) { return make_pose<double>(rotation_from_vector<double>(vector(2)), vector(size)); }
};

Registration with_scale(double scale, unsigned seed = 7) {
  Random random{std::mt19937(seed)};
  const Posed X_WD = random.pose(0.3);
  return Registration(X_WD, random.pose(0.08), scale);
}

constexpr double kScales[] = {0.2, 1.0, 3.0};

TEST_CASE("registration: without one, device and world are the same") {
  const Registration none;
  Random random;
  const Posed X = random.pose(0.1);
  const Wrenchd w{random.vector(3), random.vector(0.1)};
  CHECK((none.tool_pose(X).matrix() - X.matrix()).norm() == 0.0);
  CHECK(none.device_wrench(w, X).force == w.force);
  CHECK((none.device_wrench(w, X).torque - w.torque).norm() == 0.0);
}

TEST_CASE("registration: by hand, one quarter turn, an offset and half scale") {
  // D's x axis is W's y axis; D lies 1 m up. The tip is 0.1 m along the handle's -z.
  const Mat3d quarter = rotation_from_vector<double>(Vec3d(0, 0, std::numbers::pi / 2));
  const Registration registration(make_pose<double>(quarter, Vec3d(0, 0, 1)),
                                  make_pose<double>(Mat3d::Identity(), Vec3d(0, 0, -0.1)), 0.5);
  const Posed X_DH(Eigen::Translation3d(0.2, 0, 0.3));  // the tip is at (0.2, 0, 0.2) in D
  const Posed X_WT = registration.tool_pose(X_DH);
  CHECK((X_WT.translation() - Vec3d(0, 0.1, 1.1)).norm() < 1e-15);
  CHECK((X_WT.linear() - quarter).norm() < 1e-15);
  // 2 N along W's y is 2 N along D's x; at the tip, 0.1 m below H, it turns H about -y... by r × f = -z × x = -y.
  const Wrenchd w = registration.device_wrench({Vec3d(0, 2, 0), Vec3d(0, 0, 0.03)}, X_DH);
  CHECK((w.force - Vec3d(2, 0, 0)).norm() < 1e-15);
  CHECK((w.torque - Vec3d(0, -0.2, 0.06)).norm() < 1e-15);
}

TEST_CASE("registration: handle_pose is the inverse of tool_pose") {
  Random random;
  for (const double scale : kScales) {
    const Registration registration = with_scale(scale);
    const Posed X_DH = random.pose(0.1);
    CHECK((registration.handle_pose(registration.tool_pose(X_DH)).matrix() - X_DH.matrix()).norm() < 1e-14);
  }
}

TEST_CASE("registration: virtual work at the hand is that in the world, divided by scale") {
  Random random;
  for (const double scale : kScales)
    for (int n = 0; n < 20; ++n) {
      const Registration registration = with_scale(scale, static_cast<unsigned>(n));
      const Posed X_DH = random.pose(0.1);
      const Wrenchd world{random.vector(3), random.vector(0.2)};
      const Wrenchd hand = registration.device_wrench(world, X_DH);
      // The handle moves by ±h dx, ±h dr (central difference); so does the tool.
      const Vec3d dx = random.vector(1), dr = random.vector(1);
      const double h = 1e-5;
      const auto moved = [&](double s) {
        return registration.tool_pose(
            make_pose<double>(rotation_from_vector<double>(s * dr) * X_DH.linear(), X_DH.translation() + s * dx));
      };
      const Posed before = moved(-h), after = moved(h);
      const Vec3d dx_W = (after.translation() - before.translation()) / (2 * h);
      const Vec3d dr_W = turn_between(before, after) / (2 * h);
      const double at_hand = hand.force.dot(dx) + hand.torque.dot(dr);
      const double in_world = world.force.dot(dx_W) + world.torque.dot(dr_W);
      CAPTURE(scale);
      CHECK(at_hand == near(in_world / scale, 6.6e-10));  // central difference: h² and rounding / h
    }
}

/// A law with a potential in the world: U = k/2 |p_WQ|² + kθ/2 (1 - z·z0)·2 + a coupling, Q a point of the tool.
Wrenchd coupled_law(const Posed& X_WT) {
  const Vec3d r = X_WT.linear() * Vec3d(0.01, 0.02, 0.03);
  const Vec3d f = -500 * (X_WT.translation() + r - Vec3d(0.01, 0, 0));
  Wrenchd w = Wrenchd::of_force_at(f, r);
  const Vec3d z = X_WT.linear().col(2), goal = Vec3d::UnitX();
  w.torque += 0.3 * z.cross(goal);
  return w;
}

TEST_CASE("registration: a law with a potential makes no energy around a closed path of the hand, at any scale") {
  for (const double scale : kScales) {
    const Registration registration = with_scale(scale);
    const int steps = 20000;
    // Turns and moves out of phase: only together do they enclose anything.
    const auto handle = [](double s) {
      return make_pose<double>(
          rotation_from_vector<double>(Vec3d(0.5 * std::sin(s), 0.4 * std::sin(2 * s), 0.3 * std::cos(s))),
          Vec3d(0.03 * std::cos(s), 0.02 * std::cos(2 * s), 0.03 * std::sin(s)));
    };
    double work = 0, travelled = 0;
    for (int i = 0; i < steps; ++i) {
      const double s = 2 * std::numbers::pi / steps;
      const Posed X0 = handle(s * i), X1 = handle(s * (i + 1)), X = handle(s * (i + 0.5));
      const Wrenchd w = registration.device_wrench(coupled_law(registration.tool_pose(X)), X);
      const Vec3d dx = X1.translation() - X0.translation();
      const Vec3d dr = turn_between(X0, X1);
      work += w.force.dot(dx) + w.torque.dot(dr);
      travelled += std::abs(w.force.dot(dx)) + std::abs(w.torque.dot(dr));
    }
    CAPTURE(scale);
    CHECK(travelled > 0.1);
    CHECK(std::abs(work) < 4.7e-9 * travelled);  // midpoint rule, 20000 steps
  }
}

TEST_CASE("registration: felt stiffness, in translation and rotation") {
  for (const double scale : kScales) {
    const Registration registration = with_scale(scale);
    const double k = 800, k_angular = 0.3, h = 1e-6;
    const Posed X0 = registration.handle_pose(Posed::Identity());
    const auto law = [&](const Posed& X_WT) {
      return Wrenchd{-k * X_WT.translation(), -k_angular * rotation_vector<double>(X_WT.linear())};
    };
    Posed moved = X0;
    moved.translation() += h * Vec3d::UnitY();
    const Wrenchd push = registration.device_wrench(law(registration.tool_pose(moved)), moved);
    CHECK(-push.force.y() / h == near(registration.device_stiffness(k), 1.3e-9));
    CHECK(registration.device_stiffness(k) == near(scale * k));
    // Turned about T, which then stays where it was.
    const Posed X_DT = X0 * registration.X_HT();
    const Mat3d turn = rotation_from_vector<double>(h * Vec3d::UnitX());
    const Posed turned = make_pose<double>(turn * X_DT.linear(), X_DT.translation()) * registration.X_HT().inverse();
    const Wrenchd twist = registration.device_wrench(law(registration.tool_pose(turned)), turned);
    CHECK(twist.force.norm() < 1e-11);
    CHECK(-twist.torque.x() / h == near(registration.device_angular_stiffness(k_angular), 9e-8));
    CHECK(registration.device_angular_stiffness(k_angular) == near(k_angular / scale));
  }
}

TEST_CASE("registration: a force through H gives no torque there") {
  const Registration registration = with_scale(1.0);
  Random random;
  const Posed X_DH = random.pose(0.1);
  const Posed X_WT = registration.tool_pose(X_DH);
  const Vec3d p_WH = registration.X_WD() * Vec3d(X_DH.translation());
  const Wrenchd w = Wrenchd::of_force_at(random.vector(3), p_WH - X_WT.translation());
  CHECK(registration.device_wrench(w, X_DH).torque.norm() < 1e-14);
}

TEST_CASE("registration: refuses poses and scales that are none") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double scale : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(Registration(Posed::Identity(), Posed::Identity(), scale), std::invalid_argument);
  Posed mirror = Posed::Identity(), stretched = Posed::Identity(), lost = Posed::Identity(), empty = Posed::Identity();
  mirror.linear()(0, 0) = -1;
  stretched.linear() *= 1.001;
  lost.translation().y() = nan;
  empty.linear()(2, 1) = nan;
  for (const Posed& bad : {mirror, stretched, lost, empty}) {
    CHECK_THROWS_AS(Registration{bad}, std::invalid_argument);
    CHECK_THROWS_AS(Registration(Posed::Identity(), bad), std::invalid_argument);
  }
  try {
    Registration bad(Posed::Identity(), Posed::Identity(), -2);
  } catch (const std::invalid_argument& e) {
    CHECK(std::string(e.what()) == "trephine::Registration: scale must be > 0 and finite, got -2");
  }
}

TEST_CASE("registration: a rotation of single precision is accepted and made orthonormal") {
  const Mat3d R = rotation_from_vector<double>(Vec3d(1, 2, 0.5)).cast<float>().cast<double>();
  REQUIRE((R.transpose() * R - Mat3d::Identity()).norm() > 1e-9);
  const Registration registration(make_pose<double>(R, Vec3d::Zero()));
  const Mat3d kept = registration.X_WD().linear();
  CHECK((kept.transpose() * kept - Mat3d::Identity()).norm() < 1e-15);
  CHECK((kept - R).norm() < 6.5e-8);
}

}  // namespace
