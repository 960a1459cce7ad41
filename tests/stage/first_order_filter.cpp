// SPDX-License-Identifier: MIT
#include <trephine/stage/first_order_filter.hpp>

#include "fakes.hpp"
#include "support/near.hpp"

#include <complex>
#include <numbers>

using namespace trephine;
using namespace trephine::test;

namespace {

const TickInput kIdle;

Wrenchd pass(FirstOrderFilter& filter, Wrenchd w, double dt) {
  filter.apply(touching(kIdle, dt), w);
  return w;
}

}  // namespace

TEST_CASE("filter: the step response is 1 - exp(-2 pi f t) at every tick rate") {
  for (const double dt : {1e-5, 2.5e-4, 1e-3, 2e-3, 1e-2}) {
    FirstOrderFilter filter{{.cutoff = 80}};
    const Wrenchd in{Vec3d(1, -2, 3), Vec3d(0.1, 0.2, -0.3)};
    for (int k = 1; k <= 200; ++k) {
      const Wrenchd out = pass(filter, in, dt);
      const double expected = -std::expm1(-2 * std::numbers::pi * 80 * dt * k);
      CHECK((out.force - expected * in.force).norm() < 1e-12);
      CHECK((out.torque - expected * in.torque).norm() < 1e-13);
    }
  }
}

TEST_CASE("filter: unsteady ticks change nothing") {
  FirstOrderFilter filter{{.cutoff = 80}};
  double t = 0;
  for (int k = 0; k < 500; ++k) {
    const double dt = 1e-4 * (1 + k * k % 17);
    t += dt;
    const double out = pass(filter, {Vec3d(1, 0, 0), Vec3d::Zero()}, dt).force.x();
    CHECK(out == near(-std::expm1(-2 * std::numbers::pi * 80 * t), 1e-14));
  }
}

TEST_CASE("filter: the same cut-off at 500 Hz and at 4 kHz") {
  // Gain of the analogue filter at f_c is 1/√2. Held samples differ from it by the hold, which is why a low cut-off is
  // measured: α/|e^{iω dt} − (1 − α)| is the exact gain of the discrete filter.
  const auto gain = [](double rate) {
    FirstOrderFilter filter{{.cutoff = 10}};
    const double dt = 1 / rate;
    std::complex<double> sum = 0;
    const int settle = static_cast<int>(rate);
    for (int k = 0; k < 2 * settle; ++k) {
      const double phase = 2 * std::numbers::pi * 10 * dt * k;
      const double out = pass(filter, {Vec3d(std::sin(phase), 0, 0), Vec3d::Zero()}, dt).force.x();
      if (k >= settle) sum += out * std::polar(1.0, -phase);
    }
    return 2 * std::abs(sum) / settle;
  };
  CHECK(gain(500) == near(std::sqrt(0.5), 0.001));
  CHECK(gain(4000) == near(std::sqrt(0.5), 3e-5));
  CHECK(gain(500) == near(gain(4000), 0.001));
}

TEST_CASE("filter: a constant passes unchanged, a ramp comes 1/(2 pi f) late") {
  FirstOrderFilter filter{{.cutoff = 50}};
  const Wrenchd in{Vec3d(0.1, 3.3, -7), Vec3d(0.01, 0, 0)};
  Wrenchd out;
  for (int k = 0; k < 1000; ++k) out = pass(filter, in, kTick);
  CHECK((out.force - in.force).norm() < 1e-13);

  filter.forget_wrench();
  constexpr double kFine = 1e-5;
  double t = 0;
  for (int k = 0; k < 20000; ++k) {
    t += kFine;
    out = pass(filter, {Vec3d(t, 0, 0), Vec3d::Zero()}, kFine);
  }
  CHECK(t - out.force.x() == near(filter.options().delay(), 0.002));  // and half a step of 10 µs
  CHECK(filter.options().delay() == near(3.183e-3, 9.3e-5));
}

TEST_CASE("filter: fades to zero itself, not to denormal numbers") {
  FirstOrderFilter filter{{.cutoff = 50}};
  (void)pass(filter, {Vec3d(1, -1, 1), Vec3d(1, 1, 1)}, 0.1);
  for (int k = 0; k < 100; ++k) (void)pass(filter, {}, kTick);
  CHECK(pass(filter, {}, kTick) == Wrenchd{});
}

TEST_CASE("filter: a reset leaves the output, and a tick that sent zero has the next from zero") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, FirstOrderFilter({.cutoff = 20})};
  const auto press = [&] { return scene.tick({.X_WT = at(0, 0, -1e-3)}, kTick).wrench.force.z(); };
  const double first = press();
  for (int k = 0; k < 50; ++k) (void)press();
  const double before = press();
  scene.reset();
  CHECK(press() > before);
  CHECK(scene.tick({.X_WT = at(kNaN, 0, 0)}, kTick).wrench == Wrenchd::zero());
  CHECK(press() == first);
}

TEST_CASE("filter: a cut-off far beyond the tick rate passes every bit") {
  FirstOrderFilter filter{{.cutoff = 1e9}};
  for (int k = 1; k < 100; ++k) {
    const Wrenchd in{Vec3d(std::sin(k), 1e3 * std::cos(3 * k), 1.0 / k), Vec3d(-0.1 * k, std::sin(0.1 * k), 1e-9 / k)};
    CHECK(pass(filter, in, kTick) == in);
  }
}

TEST_CASE("filter: a new cut-off makes no step") {
  FirstOrderFilter filter{{.cutoff = 50}};
  const Wrenchd in{Vec3d(1, 0, 0), Vec3d::Zero()};
  const double before = pass(filter, in, kTick).force.x();
  filter.adopt({.cutoff = 5});
  const double after = pass(filter, in, kTick).force.x();
  CHECK(after > before);
  CHECK(after - before < 0.04);
}

TEST_CASE("filter refuses a cut-off that is none") {
  CHECK(refusal([] { FirstOrderFilter{{.cutoff = 0}}; }) ==
        "trephine::FirstOrderFilter: cutoff must be finite and > 0 Hz, got 0");
  CHECK(!refusal([] { FirstOrderFilter{{.cutoff = -3}}; }).empty());
  CHECK(!refusal([] { FirstOrderFilter{{.cutoff = kNaN}}; }).empty());
  CHECK(!refusal([] { FirstOrderFilter{{.cutoff = kInf}}; }).empty());
}
