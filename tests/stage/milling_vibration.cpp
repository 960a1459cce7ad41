// SPDX-License-Identifier: MIT
#include <trephine/stage/milling_vibration.hpp>

#include "fakes.hpp"
#include "support/near.hpp"

#include <complex>
#include <numbers>

using namespace trephine;
using namespace trephine::test;

namespace {

const TickInput kSpinning{.X_WT = Posed::Identity(), .spindle_on = true};
const Wrenchd kPress{Vec3d(5, 0, 0), Vec3d(0, 0, 0.01)};  // across the shaft, which is along z

/// What the stage adds over a second, tick by tick.
std::vector<Vec3d> added(MillingVibration& vibration, double dt, int ticks, const TickInput& input = kSpinning) {
  std::vector<Vec3d> out;
  for (int k = 0; k < ticks; ++k) {
    Wrenchd w = kPress;
    vibration.apply(touching(input, dt), w);
    CHECK(w.torque == kPress.torque);
    out.push_back(w.force - kPress.force);
  }
  return out;
}

/// Amplitude of the component at f of a signal along y, over whole periods.
double amplitude_at(const std::vector<Vec3d>& signal, double f, double dt) {
  std::complex<double> sum = 0;
  for (std::size_t k = 0; k < signal.size(); ++k)
    sum += signal[k].y() * std::polar(1.0, -2 * std::numbers::pi * f * dt * static_cast<double>(k));
  return 2 * std::abs(sum) / static_cast<double>(signal.size());
}

}  // namespace

TEST_CASE("vibration: one line in the spectrum, at the set frequency, with zero mean") {
  MillingVibration vibration{{.frequency = 180, .per_force = 0.04}};
  const auto signal = added(vibration, kTick, 1000);
  Vec3d mean = Vec3d::Zero();
  for (const Vec3d& f : signal) {
    mean += f / 1000.0;
    CHECK(std::abs(f.x()) < 1e-15);  // across the contact force
    CHECK(std::abs(f.z()) < 1e-15);  // along axis × force
  }
  CHECK(mean.norm() < 1e-12);
  CHECK(amplitude_at(signal, 180, kTick) == near(0.2, 1e-9));
  for (int f = 1; f < 500; ++f)
    if (f != 180) CHECK(amplitude_at(signal, f, kTick) < 1e-10);
}

TEST_CASE("vibration: the same at the same time at any tick rate") {
  for (const double rate : {1000.0, 2000.0, 4000.0, 10000.0}) {
    MillingVibration vibration{{.frequency = 130, .per_force = 0.04}};
    const double dt = 1 / rate;
    const auto signal = added(vibration, dt, static_cast<int>(rate));
    CHECK(amplitude_at(signal, 130, dt) == near(0.2, 1e-9));
    for (std::size_t k = 0; k < signal.size(); k += 7)
      CHECK(signal[k].y() ==
            within(0.2 * std::sin(2 * std::numbers::pi * 130 * dt * static_cast<double>(k + 1)), 1e-8));
  }
  MillingVibration unsteady{{.frequency = 130, .per_force = 0.04}};
  double t = 0;
  for (int k = 0; k < 3000; ++k) {
    const double dt = (k % 3 + 1) * 0.4e-3;
    t += dt;
    CHECK(added(unsteady, dt, 1)[0].y() == within(0.2 * std::sin(2 * std::numbers::pi * 130 * t), 1e-8));
  }
}

TEST_CASE("vibration: amplitude by force and by removal, up to its limit") {
  const auto amplitude = [](const MillingVibration::Options& options, double removed_mm3) {
    MillingVibration vibration{options};
    double largest = 0;
    for (int k = 0; k < 1000; ++k) {
      auto c = touching(kSpinning);
      c.removed_mm3 = removed_mm3;
      Wrenchd w = kPress;
      vibration.apply(c, w);
      largest = std::max(largest, (w.force - kPress.force).norm());
    }
    return largest;
  };
  // 250 Hz at 1 kHz meets the crest of the sine exactly.
  CHECK(amplitude({.frequency = 250, .per_force = 0.02}, 0) == near(0.1, 1e-9));
  CHECK(amplitude({.frequency = 250, .per_force = 0, .per_removal = 0.01}, 0.02) == near(0.2, 1e-9));
  CHECK(amplitude({.frequency = 250, .per_force = 0.02, .per_removal = 0.01}, 0.02) == near(0.3, 1e-9));
  CHECK(amplitude({.frequency = 250, .per_force = 1, .amplitude_limit = 0.3}, 0) == near(0.3, 1e-9));
  CHECK(amplitude({.frequency = 250, .per_force = 1, .amplitude_limit = 0}, 0) == 0);
}

TEST_CASE("vibration: nothing without spindle, contact or force, and a start from zero") {
  MillingVibration vibration{{.frequency = 180}};
  (void)added(vibration, kTick, 3);
  for (const Vec3d& f : added(vibration, kTick, 20, {.X_WT = Posed::Identity(), .spindle_on = false}))
    CHECK(f == Vec3d::Zero());
  // The spindle starts in a held contact: the first step is that of the sine, not a kick.
  CHECK(added(vibration, 1e-4, 1)[0].y() == near(0.4 * std::sin(2 * std::numbers::pi * 0.018), 1e-12));
  auto c = touching(kSpinning);
  c.contact = {};
  Wrenchd w = kPress;
  vibration.apply(c, w);
  CHECK(w == kPress);
  Wrenchd none;
  vibration.apply(touching(kSpinning), none);
  CHECK(none == Wrenchd{});
}

TEST_CASE("vibration: silent where the rate cannot carry the frequency") {
  MillingVibration vibration{{.frequency = 250}};
  for (const double dt : {2e-3, 3e-3, 0.1})
    for (const Vec3d& f : added(vibration, dt, 20)) CHECK(f == Vec3d::Zero());
  double largest = 0;
  for (const Vec3d& f : added(vibration, 1.9e-3, 20)) largest = std::max(largest, f.norm());
  CHECK(largest > 0.1);
}

TEST_CASE("vibration: stays across the force and never flips while the force turns every way") {
  MillingVibration vibration{{.frequency = 1e-6, .per_force = 0.1}};  // a standing sine shows the direction
  const TickInput input = kSpinning;
  Vec3d before = Vec3d::Zero();
  for (int k = 0; k < 20000; ++k) {
    const double a = 1e-3 * k;
    const Vec3d n = Vec3d(std::cos(a), std::sin(2.3 * a), std::sin(a)).normalized();  // passes along the shaft too
    Wrenchd w{5 * n, Vec3d::Zero()};
    vibration.apply(touching(input), w);
    const Vec3d d = (w.force - 5 * n).normalized();
    if (k < 100) {  // the sine needs a little to leave the rounding of the sum
      before = d;
      continue;
    }
    CHECK(std::abs(d.dot(n)) < 1e-4);
    CHECK((d - before).norm() < 0.01);
    before = d;
  }
}

TEST_CASE("vibration: along the shaft's axis it takes the tool's x axis") {
  MillingVibration vibration{{.frequency = 250}};
  Wrenchd w{Vec3d(0, 0, 4), Vec3d::Zero()};
  vibration.apply(touching(kSpinning), w);
  CHECK((w.force - Vec3d(0.32, 0, 4)).norm() < 1e-14);
}

TEST_CASE("vibration refuses frequencies that would alias, and everything out of range") {
  CHECK(refusal([] { MillingVibration{{.frequency = 300.1}}; }) ==
        "trephine::MillingVibration: frequency must be in (0, 300] Hz, got 300.1");
  CHECK(refusal([] { MillingVibration{{.frequency = 300}}; }).empty());
  CHECK(!refusal([] { MillingVibration{{.frequency = 0}}; }).empty());
  CHECK(!refusal([] { MillingVibration{{.frequency = kNaN}}; }).empty());
  CHECK(!refusal([] { MillingVibration{{.per_force = -1}}; }).empty());
  CHECK(!refusal([] { MillingVibration{{.per_removal = kNaN}}; }).empty());
  CHECK(!refusal([] { MillingVibration{{.amplitude_limit = kInf}}; }).empty());
}
