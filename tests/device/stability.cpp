// SPDX-License-Identifier: MIT
// The simulated device in a closed loop with an analytic wall: where sampled-data theory says that it turns unstable,
// and the energy that a hold makes. These are the references for every closed-loop figure taken with the device.
#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/device/simulated_device.hpp>

#include "support/near.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <complex>
#include <numbers>

namespace {

using namespace trephine;
using test::near;

constexpr double kPeriod = 1e-3;

struct Plant {
  double mass, damping, hand_stiffness;
};

/// Exact zero-order hold of the plant by its two roots, for the oracle: another way than the device's own.
Eigen::Matrix<double, 2, 3> held(const Plant& plant) {
  using Complex = std::complex<double>;
  const double a = plant.damping / (2 * plant.mass), w2 = plant.hand_stiffness / plant.mass, h = kPeriod;
  const Complex root = std::sqrt(Complex(a * a - w2)), r1 = -a + root, r2 = -a - root;
  const Complex e1 = std::exp(r1 * h), e2 = std::exp(r2 * h), d = r1 - r2;
  const double xx = ((r1 * e2 - r2 * e1) / d).real(), xv = ((e1 - e2) / d).real();
  const double vv = ((r1 * e1 - r2 * e2) / d).real(), vx = -w2 * xv, vu = xv / plant.mass;
  const double xu = plant.hand_stiffness > 0 ? (1 - xx) / plant.hand_stiffness : (h - xv) / plant.damping;
  Eigen::Matrix<double, 2, 3> m;
  m << xx, xv, xu, vx, vv, vu;
  return m;
}

/// Spectral radius of the loop  u = −K x − B (x − x₋)/T  that acts `delay` ticks later.
double spectral_radius(const Plant& plant, double K, double B, int delay) {
  // State: x, v, x₋, u of the last `delay` ticks.
  const auto m = held(plant);
  const int n = 3 + delay;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  Eigen::RowVectorXd law = Eigen::RowVectorXd::Zero(n);
  law(0) = -K - B / kPeriod;
  law(2) = B / kPeriod;
  Eigen::RowVectorXd acting = law;
  if (delay > 0) {
    acting = Eigen::RowVectorXd::Zero(n);
    acting(2 + delay) = 1;  // the oldest
    A.row(3) = law;
    for (int i = 1; i < delay; ++i) A(3 + i, 2 + i) = 1;
  }
  A.block(0, 0, 2, 2) = m.leftCols<2>();
  A.row(0) += m(0, 2) * acting;
  A.row(1) += m(1, 2) * acting;
  A(2, 0) = 1;
  return A.eigenvalues().cwiseAbs().maxCoeff();
}

/// Largest K for which `stable(K)` holds, to 5e-4 of itself; it must lie within `bracket` of the guess.
template <class Stable>
double critical(double guess, double bracket, Stable&& stable) {
  double low = guess / bracket, high = guess * bracket;
  REQUIRE(stable(low));
  REQUIRE_FALSE(stable(high));
  while (high / low > 1.0005) {
    const double K = std::sqrt(low * high);
    (stable(K) ? low : high) = K;
  }
  return low;
}

/// Growth per tick of a decaying or growing oscillation: x₀² − x₋ x₊ is A² r^(2k) sin²θ, without ripple.
class Growth {
 public:
  static constexpr int kFirst = 400, kLast = 1200;

  /// True when the answer is known early: it has blown up.
  bool add(double x) {
    blown_ |= !(std::abs(x) < 1e6);
    x0_ = x1_, x1_ = x2_, x2_ = x;
    const double strength = std::abs(x1_ * x1_ - x0_ * x2_);
    if (count_ == kFirst) first_ = strength;
    if (count_ == kLast) last_ = strength;
    ++count_;
    return blown_;
  }
  /// A motion that has died down is stable, whatever its last bits do.
  [[nodiscard]] bool grows() const { return blown_ || (last_ > first_ && std::abs(x2_) > 1e-12); }

 private:
  double x0_ = 0, x1_ = 0, x2_ = 0, first_ = 0, last_ = 0;
  int count_ = 0;
  bool blown_ = false;
};

enum class Motion { kTranslation, kRotation };

/// Whether the simulated device settles against the wall from a small disturbance.
bool settles(Motion motion, const Plant& plant, double K, double B, int delay, int substeps) {
  const Vec3d along = Vec3d(2, 3, 6) / 7.0;
  // Rotation: every constant is multiplied by the square of an arm, so that K_crit is too.
  const double unit = motion == Motion::kRotation ? 1e-3 : 1.0;
  SimulatedDeviceOptions o;
  // The device has 2/5 of mass and damping, the hand the rest.
  const DeviceAxes axes{.inertia = 0.4 * unit * plant.mass, .damping = 0.4 * unit * plant.damping};
  const HandAxes hand{.inertia = 0.6 * unit * plant.mass,
                      .damping = 0.6 * unit * plant.damping,
                      .stiffness = unit * plant.hand_stiffness};
  o.linear = o.angular = axes;
  o.hand_linear = o.hand_angular = hand;
  o.delay_ticks = delay;
  o.substeps = substeps;
  const double start = 1e-3;
  if (motion == Motion::kTranslation)
    o.X_DH.translation() = start * along;
  else
    o.X_DH.linear() = rotation_from_vector<double>(start * along);
  SimulatedDevice device(o, StillHand{});

  Growth growth;
  DeviceState state;
  double last = start;
  for (int i = 0; i <= Growth::kLast; ++i) {
    if (device.read(state) != DeviceStatus::kOk) return false;
    const double x = motion == Motion::kTranslation ? state.X_DH.translation().dot(along)
                                                    : rotation_vector<double>(state.X_DH.linear()).dot(along);
    if (growth.add(motion == Motion::kRotation && std::abs(x) > 1 ? 1e9 : x)) return false;
    const Vec3d u = -unit * (K * x + B * (x - last) / kPeriod) * along;
    last = x;
    const Wrenchd wrench = motion == Motion::kTranslation ? Wrenchd{u, Vec3d::Zero()} : Wrenchd{Vec3d::Zero(), u};
    if (device.write(wrench) != DeviceStatus::kOk) return false;
    device.advance(kPeriod);
  }
  return !growth.grows();
}

struct Row {
  Plant plant;
  double published[3];  // exact zero-order hold, delay 0, 1, 2 ticks [N/m], rounded to whole numbers
};

constexpr Row kRows[] = {
    {{.045, .5, 0}, {1002, 334, 201}},
    {{.075, .05, 0}, {100, 33, 20}},
    {{.145, 3.1, 200}, {6223, 2080, 1253}},
    {{.04, 8.8, 400}, {18285, 6226, 3855}},
};

// Two bisections; the device's rounding is far below.
constexpr double kAgainstEigenvalues = 5e-4;  // what bisection leaves
// The figures above are rounded: 33 stands for 33.3.
constexpr double kAgainstPublished = 0.02;

TEST_CASE("stability: critical stiffness of the simulated device is that of the exact zero-order hold") {
  for (const Motion motion : {Motion::kTranslation, Motion::kRotation})
    for (const Row& row : kRows)
      for (int delay = 0; delay <= 2; ++delay) {
        const Plant& p = row.plant;
        const double published = row.published[delay];
        const double exact = critical(published, 2, [&](double K) { return spectral_radius(p, K, 0, delay) <= 1; });
        const double found = critical(exact, 1.05, [&](double K) { return settles(motion, p, K, 0, delay, 1); });
        CAPTURE(p.mass);
        CAPTURE(delay);
        CHECK(found == near(exact, kAgainstEigenvalues));
        CHECK(found == near(published, kAgainstPublished));
      }
}

TEST_CASE("stability: the wall's own damping, by backward difference, helps less than the rule of thumb says") {
  const Plant p{.045, .5, 0};
  for (const double B : {1.0, 5.0, 25.0})
    for (int delay = 0; delay <= 2; ++delay) {
      if (B > 5 && delay > 0) continue;  // unstable at any stiffness
      const double rule = (p.damping + B) / (kPeriod * (0.5 + delay));
      const double guess = B > 5 ? 28985 : 0.85 * rule;
      const double exact = critical(guess, 2, [&](double K) { return spectral_radius(p, K, B, delay) <= 1; });
      const double found =
          critical(exact, 1.05, [&](double K) { return settles(Motion::kTranslation, p, K, B, delay, 1); });
      CAPTURE(B);
      CAPTURE(delay);
      CHECK(found == near(exact, kAgainstEigenvalues));
      CHECK(found < 1.02 * rule);
      if (B > 5) CHECK(found == near(28985, 1e-3));
    }
}

TEST_CASE("stability: twenty substeps a tick change nothing") {
  const Plant p = kRows[3].plant;
  for (const double share : {0.99, 1.01}) {
    const bool stable = share < 1;
    CHECK(settles(Motion::kTranslation, p, share * 18285, 0, 0, 20) == stable);
    CHECK(settles(Motion::kRotation, p, share * 18285, 0, 0, 20) == stable);
  }
}

TEST_CASE("stability: one tick of delay costs a factor of three") {
  const Plant p = kRows[0].plant;
  const double now = critical(1000, 1.1, [&](double K) { return settles(Motion::kTranslation, p, K, 0, 0, 1); });
  const double later = critical(333, 1.1, [&](double K) { return settles(Motion::kTranslation, p, K, 0, 1, 1); });
  CHECK(now / later == near(3, 0.0036));
}

/// Energy that a held spring makes in a sinusoidal contact, over K (T/2 + dT) ∫ v² dt, in the steady state.
double leak_ratio(Motion motion, double K, double frequency, int cycles, int ticks, int delay) {
  const Vec3d along = Vec3d(1, 2, 2) / 3.0;
  SimulatedDeviceOptions o;
  const bool turns = motion == Motion::kRotation;
  const double unit = turns ? 1e-3 : 1.0;
  o.linear = o.angular = {.inertia = 0.045 * unit, .damping = 0.5 * unit};
  o.hand_linear = o.hand_angular = {.inertia = 0.04 * unit, .damping = 8 * unit, .stiffness = 400 * unit};
  o.substeps = 5;  // of the hand; the work is measured along whatever path results
  o.delay_ticks = delay;
  SimulatedDevice device(o, [=](double t) {
    const Vec3d x = 0.01 * std::sin(2 * std::numbers::pi * frequency * t) * along;
    return turns ? make_pose<double>(rotation_from_vector<double>(x), Vec3d::Zero())
                 : make_pose<double>(Mat3d::Identity(), x);
  });
  double made = 0, speed2 = 0, last = 0;
  DeviceState state;
  const int settle = 1000;  // whole cycles of all frequencies used
  for (int i = 0; i <= settle + ticks; ++i) {
    REQUIRE(device.read(state) == DeviceStatus::kOk);
    const double x =
        (turns ? rotation_vector<double>(state.X_DH.linear()) : Vec3d(state.X_DH.translation())).dot(along);
    if (i > settle) {
      const Vec3d& sent = turns ? device.applied().torque : device.applied().force;
      const Twist v = device.velocity();
      made += sent.dot(along) * (x - last);
      speed2 += (turns ? v.angular : v.linear).squaredNorm() * kPeriod;
    }
    last = x;
    const Vec3d u = -K * unit * x * along;
    REQUIRE(device.write(turns ? Wrenchd{Vec3d::Zero(), u} : Wrenchd{u, Vec3d::Zero()}) == DeviceStatus::kOk);
    device.advance(kPeriod);
  }
  CHECK(cycles * 1000 == near(frequency * ticks));
  return made / (K * unit * kPeriod * (0.5 + delay) * speed2);
}

TEST_CASE("stability: a held spring in sustained contact makes K (T/2 + dT) ∫ v² dt") {
  for (const Motion motion : {Motion::kTranslation, Motion::kRotation})
    for (const double frequency : {5.0, 50.0, 150.0})
      for (int delay = 0; delay <= 2; ++delay) {
        const int ticks = 1000;
        const double ratio = leak_ratio(motion, 300, frequency, static_cast<int>(frequency), ticks, delay);
        // A sinusoid through a hold: its work is that of the fundamental, attenuated by sinc and late by T/2 + dT.
        const double half = std::numbers::pi * frequency * kPeriod, late = half * (1 + 2 * delay);
        const double expected = std::sin(half) / half * std::sin(late) / late;
        CAPTURE(frequency);
        CAPTURE(delay);
        CHECK(ratio == near(expected, 0.02));
        if (frequency < 10) CHECK(ratio == near(1, 0.0048));
      }
  CHECK(leak_ratio(Motion::kTranslation, 300, 150, 150, 1000, 0) == near(0.93, 0.01));
}

}  // namespace
