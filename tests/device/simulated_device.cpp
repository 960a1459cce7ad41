// SPDX-License-Identifier: MIT
// The simulated device against closed forms of mechanics.
#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/device/simulated_device.hpp>

#include "support/near.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace trephine;
using test::near;

constexpr double kPeriod = 1e-3;
// Rounding of a few thousand steps; the integration itself is exact here.
constexpr double kExact = 1.6e-13;

SimulatedDeviceOptions bare(double mass, double damping) {
  SimulatedDeviceOptions o;
  o.linear = {.inertia = mass, .damping = damping};
  o.angular = {.inertia = mass * 1e-3, .damping = damping * 1e-3};
  o.hand_linear = {};
  o.hand_angular = {};
  return o;
}

Wrenchd force(double x, double y, double z) { return {Vec3d(x, y, z), Vec3d::Zero()}; }

template <class Device>
void run(Device& device, const Wrenchd& wrench, int ticks) {
  for (int i = 0; i < ticks; ++i) {
    REQUIRE(device.write(wrench) == DeviceStatus::kOk);
    device.advance(kPeriod);
  }
}

TEST_CASE("simulated device: free fall") {
  SimulatedDevice device(bare(0.3, 0.0));
  run(device, force(0, 0, -9.81 * 0.3), 500);
  const double t = 0.5;
  CHECK(std::abs(device.X_DH().translation().z() + 0.5 * 9.81 * t * t) < kExact);
  CHECK(std::abs(device.velocity().linear.z() + 9.81 * t) < kExact);
  CHECK(device.X_DH().translation().head<2>().norm() == 0.0);
  CHECK(std::abs(device.time() - t) < kExact);
}

TEST_CASE("simulated device: viscous drag alone") {
  const double m = 0.045, b = 0.5, f = 0.2;
  for (const int substeps : {1, 20}) {
    SimulatedDeviceOptions o = bare(m, b);
    o.substeps = substeps;
    SimulatedDevice device(o);
    run(device, force(f, 0, 0), 300);
    const double t = 0.3, tau = m / b;
    CHECK(std::abs(device.X_DH().translation().x() - f / b * (t - tau * (1 - std::exp(-t / tau)))) < kExact);
    CHECK(std::abs(device.velocity().linear.x() - f / b * (1 - std::exp(-t / tau))) < kExact);
  }
}

TEST_CASE("simulated device: a step of the hand, under-, over- and critically damped") {
  const double m = 0.045, mh = 0.035, k = 400, step = 0.01;
  const double critical = 2 * std::sqrt((m + mh) * k);
  for (const double damping : {0.2 * critical, critical, 3 * critical}) {
    CAPTURE(damping);
    SimulatedDeviceOptions o = bare(m, 0.25 * damping);
    o.hand_linear = {.inertia = mh, .damping = 0.75 * damping, .stiffness = k};
    SimulatedDevice device(o, [&](double) { return Posed(Eigen::Translation3d(0, step, 0)); });
    const double w = std::sqrt(k / (m + mh)), z = damping / critical;
    double worst = 0;
    for (int i = 1; i <= 200; ++i) {
      device.advance(kPeriod);
      const double t = i * kPeriod;
      double decay;  // (x − x_d) / (x_0 − x_d)
      if (z < 1) {
        const double wd = w * std::sqrt(1 - z * z);
        decay = std::exp(-z * w * t) * (std::cos(wd * t) + z * w / wd * std::sin(wd * t));
      } else if (z > 1) {
        const double r = w * std::sqrt(z * z - 1);
        decay = std::exp(-z * w * t) * (std::cosh(r * t) + z * w / r * std::sinh(r * t));
      } else {
        decay = std::exp(-w * t) * (1 + w * t);
      }
      worst = std::max(worst, std::abs(device.X_DH().translation().y() - step * (1 - decay)));
    }
    CHECK(worst < kExact);
  }
}

TEST_CASE("simulated device: a swinging hand, amplitude and phase of the steady state") {
  SimulatedDeviceOptions o = bare(0.045, 0.5);
  o.hand_linear = {.inertia = 0.04, .damping = 8, .stiffness = 400};
  const double amplitude = 0.01, frequency = 2 * std::numbers::pi * 5;
  SimulatedDevice device(
      o, [&](double t) { return Posed(Eigen::Translation3d(amplitude * std::sin(frequency * t), 0, 0)); });
  const double real = 400 - 0.085 * frequency * frequency, imaginary = 8.5 * frequency;
  const double expected = amplitude * 400 / std::hypot(real, imaginary), phase = std::atan2(imaginary, real);
  double worst = 0;
  for (int i = 1; i <= 2000; ++i) {
    device.advance(kPeriod);
    const double x = expected * std::sin(frequency * i * kPeriod - phase);
    if (i >= 1000) worst = std::max(worst, std::abs(device.X_DH().translation().x() - x));
  }
  // The target is held over a substep of 50 µs, at its middle: (2π 5 Hz · 50 µs)²/24 = 1e-7 of the amplitude. Held at
  // an end it would be 8e-4.
  CHECK(worst < 2.9e-7 * amplitude);
}

TEST_CASE("simulated device: constant torque turns it about any axis, past half a turn") {
  SimulatedDevice device(bare(0.04, 0.0));
  const Vec3d axis = Vec3d(1, 2, -2) / 3.0;
  const double inertia = 4e-5, torque = 1e-3;
  run(device, {Vec3d::Zero(), torque * axis}, 600);
  const double t = 0.6, angle = 0.5 * torque / inertia * t * t;
  CHECK(angle > std::numbers::pi);
  const Mat3d expected = rotation_from_vector<double>(angle * axis);
  CHECK((device.X_DH().linear() - expected).norm() < 1e-11);
  CHECK((device.velocity().angular - torque / inertia * t * axis).norm() < 4.3e-12);
  CHECK(device.X_DH().translation().norm() == 0.0);
}

TEST_CASE("simulated device: the hand's rotation spring") {
  SimulatedDeviceOptions o = bare(0.04, 0.0);
  o.angular = {.inertia = 4e-5, .damping = 1e-4};
  o.hand_angular = {.inertia = 1e-5, .damping = 1e-3, .stiffness = 0.4};
  const Vec3d axis = Vec3d(2, -1, 2) / 3.0;
  const double start = 0.7, target = 1.1;  // about one axis: the closed form holds
  o.X_DH.linear() = rotation_from_vector<double>(start * axis);
  const Mat3d R_target = rotation_from_vector<double>(target * axis);
  SimulatedDevice device(o, [&](double) { return make_pose<double>(R_target, Vec3d::Zero()); });
  const double J = 5e-5, b = 1.1e-3, k = 0.4, w = std::sqrt(k / J), z = b / (2 * std::sqrt(k * J));
  const double wd = w * std::sqrt(1 - z * z);
  double worst = 0;
  for (int i = 1; i <= 100; ++i) {
    device.advance(kPeriod);
    const double t = i * kPeriod;
    const double decay = std::exp(-z * w * t) * (std::cos(wd * t) + z * w / wd * std::sin(wd * t));
    const double angle = target + (start - target) * decay;
    worst = std::max(worst, (device.X_DH().linear() - rotation_from_vector<double>(angle * axis)).norm());
  }
  CHECK(worst < 1e-13);
}

TEST_CASE("simulated device: stiction holds below Coulomb friction, and not above") {
  SimulatedDeviceOptions o = bare(0.045, 0.0);
  o.linear.friction = 0.1;
  o.angular.friction = 1e-3;
  const Vec3d along = Vec3d(2, 3, 6) / 7.0;
  {
    SimulatedDevice device(o);
    run(device, {0.0999 * along, 0.999e-3 * along}, 1000);
    CHECK(device.X_DH().translation() == Vec3d::Zero());
    CHECK(device.X_DH().linear() == Mat3d::Identity());
  }
  {
    SimulatedDevice device(o);
    run(device, {0.15 * along, Vec3d::Zero()}, 200);
    const double expected = 0.5 * (0.15 - 0.1) / 0.045 * 0.2 * 0.2;
    CHECK((device.X_DH().translation() - expected * along).norm() < kExact);
  }
}

TEST_CASE("simulated device: friction stops it after m v² / (2 f), then it rests") {
  SimulatedDeviceOptions o = bare(0.045, 0.0);
  o.linear.friction = 0.1;
  SimulatedDevice device(o);
  run(device, force(0.5, 0, 0), 50);
  const double v = device.velocity().linear.x(), x = device.X_DH().translation().x();
  CHECK(v == near(0.4 / 0.045 * 0.05));
  run(device, Wrenchd::zero(), 400);
  // It may stop anywhere in a substep of 50 µs.
  const double end_of_substep = 0.1 / 0.045 * 50e-6 * 50e-6;
  CHECK(std::abs(device.X_DH().translation().x() - (x + 0.045 * v * v / 0.2)) < end_of_substep);
  CHECK(device.velocity().linear == Vec3d::Zero());
}

TEST_CASE("simulated device: friction with a hand that pulls: sticks, then follows at a distance f/k") {
  SimulatedDeviceOptions o = bare(0.045, 0.0);
  o.linear.friction = 0.2;
  o.hand_linear = {.inertia = 0, .damping = 8, .stiffness = 400};
  const double speed = 0.01;
  SimulatedDevice device(o, [&](double t) { return Posed(Eigen::Translation3d(speed * t, 0, 0)); });
  run(device, Wrenchd::zero(), 45);
  CHECK(device.X_DH().translation().x() == 0.0);  // the spring reaches 0.2 N after 50 ms
  run(device, Wrenchd::zero(), 1955);
  const double lag = speed * device.time() - device.X_DH().translation().x();
  CHECK(lag == near((0.2 + 8 * speed) / 400, 1.5e-12));
}

TEST_CASE("simulated device: readings are whole quanta, the truth is not") {
  SimulatedDeviceOptions o = bare(0.045, 0.5);
  o.linear.quantum = 0.055e-3;
  o.angular.quantum = 2e-3;
  SimulatedDevice device(o);
  DeviceState state;
  bool off_grid = false;
  for (int i = 0; i < 200; ++i) {
    run(device, {Vec3d(0.3, -0.2, 0.1), Vec3d(1e-4, 2e-4, -1e-4)}, 1);
    REQUIRE(device.read(state) == DeviceStatus::kOk);
    const Vec3d true_p = device.X_DH().translation();
    const Vec3d true_r = rotation_vector<double>(device.X_DH().linear());
    const Vec3d read_r = rotation_vector<double>(state.X_DH.linear());
    for (int a = 0; a < 3; ++a) {
      const double steps = state.X_DH.translation()[a] / 0.055e-3, turns = read_r[a] / 2e-3;
      CHECK(std::abs(steps - std::round(steps)) < 1e-11);
      CHECK(std::abs(turns - std::round(turns)) < 1e-13);
      CHECK(std::abs(state.X_DH.translation()[a] - true_p[a]) <= 0.5 * 0.055e-3 * (1 + 1e-9));
      CHECK(std::abs(read_r[a] - true_r[a]) <= 0.5 * 2e-3 * (1 + 1e-9));
      off_grid |= std::abs(true_p[a] - state.X_DH.translation()[a]) > 0.2 * 0.055e-3;
    }
  }
  CHECK(off_grid);
}

TEST_CASE("simulated device: force and torque saturate as vectors") {
  SimulatedDeviceOptions o = bare(0.045, 0.5);
  o.linear.limit = 3.3;
  o.angular.limit = 0.1;
  SimulatedDevice device(o);
  REQUIRE(device.write({Vec3d(6, 0, 8), Vec3d(0, -3, 0)}) == DeviceStatus::kOk);
  CHECK((device.applied().force - 3.3 * Vec3d(0.6, 0, 0.8)).norm() < 1e-14);
  CHECK((device.applied().torque - Vec3d(0, -0.1, 0)).norm() < 1e-12);
  REQUIRE(device.write({Vec3d(0, 3.4, 0), Vec3d::Zero()}) == DeviceStatus::kOk);
  CHECK((device.applied().force - Vec3d(0, 3.3, 0)).norm() < 1e-12);
  REQUIRE(device.write({Vec3d(1, 1, 1), Vec3d(0.01, 0, 0)}) == DeviceStatus::kOk);
  CHECK(device.applied() == Wrenchd{Vec3d(1, 1, 1), Vec3d(0.01, 0, 0)});
  REQUIRE(device.write({Vec3d(1e300, 1e300, 0), Vec3d::Zero()}) == DeviceStatus::kOk);
  CHECK(device.applied().force.norm() == near(3.3));
}

TEST_CASE("simulated device: output degrees of freedom") {
  const Wrenchd wrench{Vec3d(1, 2, 3), Vec3d(0.1, 0.2, 0.3)};
  for (const int dof : {0, 3, 6}) {
    SimulatedDeviceOptions o = bare(0.045, 0.5);
    o.output_dof = dof;
    SimulatedDevice device(o);
    CHECK(device.capabilities().output_dof == dof);
    REQUIRE(device.write(wrench) == DeviceStatus::kOk);
    CHECK(device.applied().force == (dof >= 3 ? wrench.force : Vec3d::Zero()));
    CHECK(device.applied().torque == (dof == 6 ? wrench.torque : Vec3d::Zero()));
  }
}

TEST_CASE("simulated device: the delay is exact, in writes") {
  for (const int delay : {0, 1, 2, 8}) {
    SimulatedDeviceOptions o = bare(0.045, 0.0);
    o.delay_ticks = delay;
    SimulatedDevice device(o);
    for (int i = 0; i < 20; ++i) {
      run(device, force(i + 1, 0, 0), 1);
      CHECK(device.applied().force.x() == std::max(0, i + 1 - delay));
      CHECK((device.velocity().linear.x() > 0) == (i >= delay));
    }
  }
}

TEST_CASE("simulated device: a non-finite wrench is a fault and leaves no trace") {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int where = 0; where < 6; ++where) {
      SimulatedDeviceOptions o = bare(0.045, 0.5);
      o.delay_ticks = 2;
      SimulatedDevice device(o);
      run(device, force(1, 0, 0), 5);
      Wrenchd wrench = force(1, 1, 1);
      (where < 3 ? wrench.force : wrench.torque)[where % 3] = bad;
      CHECK(device.write(wrench) == DeviceStatus::kFault);
      CHECK(device.applied() == Wrenchd::zero());
      device.advance(kPeriod);
      run(device, force(1, 0, 0), 5);
      CHECK(device.X_DH().matrix().allFinite());
      DeviceState state;
      CHECK(device.read(state) == DeviceStatus::kOk);
    }
  }
}

TEST_CASE("simulated device: intervals that are no intervals do nothing") {
  SimulatedDevice device(bare(0.045, 0.5));
  REQUIRE(device.write(force(1, 0, 0)) == DeviceStatus::kOk);
  for (const double dt : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    device.advance(dt);
  CHECK(device.X_DH().translation() == Vec3d::Zero());
  CHECK(device.time() == 0.0);
}

TEST_CASE("simulated device: the step does not change the result, equal or not") {
  const auto end = [](auto&& next) {
    SimulatedDeviceOptions o = bare(0.045, 0.5);
    o.hand_linear = {.inertia = 0.04, .damping = 8, .stiffness = 400};
    SimulatedDevice device(o, [](double) { return Posed(Eigen::Translation3d(0.01, 0, 0)); });
    double left = 0.1;
    for (int i = 0; left > 1e-12; ++i) {
      const double dt = std::min(left, next(i));
      device.advance(dt);
      left -= dt;
    }
    return device.X_DH().translation().x();
  };
  const double reference = end([](int) { return 1e-3; });
  CHECK(std::abs(end([](int i) { return 1e-3 * (1 + i % 3); }) - reference) < kExact);
  CHECK(std::abs(end([](int) { return 1e-5; }) - reference) < kExact);
}

TEST_CASE("simulated device: buttons follow the script") {
  SimulatedDevice device(SimulatedDeviceOptions{},
                         [](double t) { return HandTarget(Posed::Identity(), t >= 0.0095 ? 3u : 0u); });
  DeviceState state;
  for (int i = 0; i < 20; ++i) {
    REQUIRE(device.read(state) == DeviceStatus::kOk);
    CHECK(state.buttons == (i >= 10 ? 3u : 0u));
    device.advance(kPeriod);
  }
}

TEST_CASE("simulated device: two runs have the same bits") {
  const auto travel = [] {
    SimulatedDevice device(SimulatedDeviceOptions{}, [](double t) {
      return make_pose<double>(rotation_from_vector<double>(Vec3d(0.3 * std::sin(9 * t), 0.1 * t, 0)),
                               Vec3d(0.01 * std::sin(20 * t), 0, 0.02 * t));
    });
    DeviceState state;
    Mat3d sum = Mat3d::Zero();
    for (int i = 0; i < 500; ++i) {
      REQUIRE(device.read(state) == DeviceStatus::kOk);
      sum += state.X_DH.linear();
      sum.col(0) += state.X_DH.translation();
      REQUIRE(device.write({-300 * state.X_DH.translation(), Vec3d::Zero()}) == DeviceStatus::kOk);
      device.advance(kPeriod);
    }
    return Eigen::Matrix4d(device.X_DH().matrix() + sum.norm() * Eigen::Matrix4d::Identity());
  };
  CHECK(travel() == travel());
}

TEST_CASE("simulated device: refuses what makes no sense") {
  const auto refused = [](auto&& change) {
    SimulatedDeviceOptions o;
    change(o);
    CHECK_THROWS_AS(SimulatedDevice{o}, std::invalid_argument);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](auto& o) { o.linear.inertia = 0; });
  refused([&](auto& o) { o.angular.inertia = nan; });
  refused([](auto& o) { o.linear.damping = -1; });
  refused([&](auto& o) { o.linear.friction = nan; });
  refused([](auto& o) { o.linear.quantum = -1e-6; });
  refused([](auto& o) { o.angular.limit = std::numeric_limits<double>::infinity(); });
  refused([](auto& o) { o.hand_linear.stiffness = -1; });
  refused([](auto& o) { o.output_dof = 4; });
  refused([](auto& o) { o.delay_ticks = -1; });
  refused([](auto& o) { o.delay_ticks = 9; });
  refused([](auto& o) { o.substeps = 0; });
  refused([](auto& o) { o.rate = 0; });
  refused([&](auto& o) { o.X_DH.translation().x() = nan; });
}

}  // namespace
