// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"

#include <trephine/render/coupled/springs.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Gains {
  double k, most, yield, radius, ramp;

  [[nodiscard]] BallOnPlane contact() const { return {most / BallOnPlane{1, radius, ramp}.force(yield), radius, ramp}; }
  [[nodiscard]] CompensatedSpring spring() const { return {k, contact(), yield}; }
};
// Of the default, soft, hard, a device of little force, a ball of four yields, small voxels.
const std::vector<Gains> kGains{{800, 8.5, 1e-4, 1.5e-3, 5e-5}, {800, 3.3, 1e-4, 1.5e-3, 5e-5},
                                {200, 3.3, 1e-4, 1.5e-3, 5e-5}, {3000, 8.5, 1e-4, 1e-3, 6e-5},
                                {800, 1, 5e-5, 1.5e-3, 4e-5},   {800, 3.3, 1e-4, 4e-4, 1e-4},
                                {800, 8.5, 3e-5, 5e-3, 1.6e-5}};

// P(δ) is by definition the mean over 0 <= s <= ramp of what max(ψ − s, 0) over a ball's contact adds up to:
// π k (R − δ) max(δ − s, 0)².
TEST_CASE("ball on plane: force is the mean over the ramp, slope and energy are its derivative and integral") {
  constexpr int kSteps = 20000;
  Figures force, slope, energy;
  for (const Gains& g : kGains) {
    const BallOnPlane c = g.contact();
    CHECK(c.force(g.yield) == near(g.most));
    double sum = 0;
    const double step = g.yield / kSteps;
    for (int i = 1; i <= kSteps; ++i) {
      const double d = i * step;
      sum += step / 6 * (c.force(d - step) + 4 * c.force(d - step / 2) + c.force(d));
      if (i % 500 != 0) continue;
      double mean = 0;
      for (int j = 0; j < kSteps; ++j) {
        const double deep = std::max(d - (j + 0.5) / kSteps * g.ramp, 0.0);
        mean += c.gain * (g.radius - d) * deep * deep / kSteps;
      }
      force.add(std::abs(c.force(d) / mean - 1));
      energy.add(std::abs(c.energy(d) / sum - 1));
      const double small = 1e-4 * d;
      slope.add(std::abs(c.slope(d) * 2 * small / (c.force(d + small) - c.force(d - small)) - 1));
    }
  }
  MESSAGE("off: force ", force, "; slope ", slope, "; energy ", energy);
  CHECK(force.worst() <= 3e-6);  // of the midpoint rule
  CHECK(slope.worst() <= 9.9e-9);
  CHECK(energy.worst() <= 2.2e-14);
}

// Contact begins offset() outside the surface: so deep below it, the two in series give way by x + δ − offset.
TEST_CASE("compensated spring: in series with the contact the hand feels k times the depth, and never more than k") {
  constexpr double kRounding = 3e-15, kSoft = 0.015;  // of the greatest force, below which the hand feels less than k
  Figures secant, tangent, inverse, soft;
  for (const Gains& g : kGains) {
    const BallOnPlane c = g.contact();
    const CompensatedSpring spring = g.spring();
    CHECK(spring.offset() > 0);
    CHECK(spring.offset() < g.ramp / 2);
    double x = 0, depth = 0;
    for (int i = 1; i <= 2000; ++i) {
      // The extension whose force is P(δ), by bisection.
      const double d = g.yield * i / 2000, P = c.force(d);
      double low = 0, high = g.most / g.k;
      for (int j = 0; j < 80; ++j) {
        const double middle = (low + high) / 2;
        (spring.evaluate(middle).magnitude < P ? low : high) = middle;
      }
      const double x_before = x, depth_before = depth;
      x = high;
      depth = x + d - spring.offset();
      CHECK(x >= x_before);
      // Never stiffer than k, and k from some milli-newtons on.
      if (i > 1) tangent.add((P - c.force(g.yield * (i - 1) / 2000)) / (depth - depth_before) / g.k - 1);
      if (P > kSoft * g.most)
        secant.add(std::abs(P / (g.k * depth) - 1));
      else
        soft.add(P / g.most - g.k * depth / g.most);
      inverse.add(std::abs(spring.evaluate(x).magnitude - P) / g.most);
    }
  }
  MESSAGE("in series, secant off k: ", secant, "; tangent over k: ", tangent,
          "; force over k times the depth, below: ", soft);
  CHECK(secant.worst() <= 5.3e-15);
  CHECK(tangent.worst() <= 1.8e-12);
  CHECK(inverse.worst() <= kRounding);
  CHECK(soft.worst() <= 0.01);
}

/// Checks that a spring's force and energy are the integrals of its tangent and force, along extensions past
/// saturation.
template <class Spring>
void check_adds_up(const Spring& spring, double k, double most, double stiffest, double saturated) {
  // Simpson's rule on smooth laws over 20000 steps; across the kink where the force saturates one step is off by its
  // square.
  constexpr double kSumError = 8e-10, kDifferenceError = 1.1e-8, kRounding = 1e-9;
  constexpr int kSteps = 20000;
  const double far = 3 * saturated, step = far / kSteps;
  double energy = 0, before = 0;
  int wrong = 0;
  Figures energy_off, tangent_off;
  for (int i = 1; i <= kSteps; ++i) {
    const double x = i * step;
    const SpringResponse a = spring.evaluate(x - step), m = spring.evaluate(x - step / 2), b = spring.evaluate(x);
    energy += step / 6 * (a.magnitude + 4 * m.magnitude + b.magnitude);
    energy_off.add(std::abs(b.energy - energy) / (most * far));
    wrong += b.magnitude >= before && b.magnitude <= most && b.tangent >= 0 && b.tangent <= stiffest * (1 + kRounding)
                 ? 0
                 : 1;
    before = b.magnitude;
    const double d = 1e-3 * step;
    const bool kink = std::abs(x - saturated) < step;
    // Where the curve bends most, at rest, it does so over some δ₀.
    if (!kink && i > 40)
      tangent_off.add(
          std::abs((spring.evaluate(x + d).magnitude - spring.evaluate(x - d).magnitude) / (2 * d) - b.tangent) / k);
  }
  CHECK(wrong == 0);
  CHECK(spring.evaluate(0).magnitude <= kRounding * most);
  CHECK(spring.evaluate(0).energy == within(0, 1e-12));
  CHECK(spring.evaluate(saturated * 1.001).magnitude == most);
  CHECK(spring.evaluate(saturated * 0.99).magnitude < most);
  CHECK(spring.evaluate(saturated * 1.001).tangent == 0);
  MESSAGE("energy off the sum of forces, of force times extension: ", energy_off, "; tangent off, of k: ", tangent_off);
  CHECK(energy_off.worst() <= kSumError);
  CHECK(tangent_off.worst() <= kDifferenceError);
}

TEST_CASE("compensated spring: energy is the sum of forces, tangent their slope, force rises to its limit and stays") {
  for (const Gains& g : kGains) {
    CAPTURE(g.k);
    CAPTURE(g.most);
    // Four times as stiff as k where the contact is too soft, and from δ_c on 1 / (1 / k − 1 / P').
    const CompensatedSpring spring = g.spring();
    const double saturated = g.most / g.k - g.yield + spring.offset();
    CHECK(spring.max_extension() == near(saturated));
    CHECK(spring.evaluate(std::nextafter(spring.max_extension(), 0)).magnitude == near(g.most));
    check_adds_up(spring, g.k, g.most, 4 * g.k, saturated);
  }
}

TEST_CASE("bounded spring: energy is the sum of forces, tangent their slope, force rises to its limit and stays") {
  check_adds_up(BoundedSpring{0.3, 0.188}, 0.3, 0.188, 0.3, 0.188 / 0.3);
  const BoundedSpring spring{2, 6};
  CHECK(spring.evaluate(1).magnitude == 2);
  CHECK(spring.evaluate(1).energy == 1);
  CHECK(spring.evaluate(5).magnitude == 6);
  CHECK(spring.evaluate(5).energy == 21);
}

}  // namespace
