// SPDX-License-Identifier: MIT
#include "support/figures.hpp"

#include <trephine/render/coupled/virtual_coupling.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Gains {
  double k, most, yield, radius;

  [[nodiscard]] CompensatedSpring spring() const { return {k, most, yield, radius}; }
  // The contact's law P(δ) = c (R − δ) δ², and below which δ it is softer than k.
  [[nodiscard]] double c() const { return most / ((radius - yield) * yield * yield); }
  [[nodiscard]] double held(double d) const { return c() * (radius - d) * d * d; }
  [[nodiscard]] double first_depth() const { return k / (c() * radius); }
  /// Extension of the spring where the contact yields by d, as the header defines it.
  [[nodiscard]] double extension(double d) const {
    const double d0 = first_depth();
    return held(d) / k - d * d * d / (d * d + d0 * d0);
  }
};
// Of the default, soft, hard, a device of little force, no yield next to the coupling's own, a ball of four yields.
const std::vector<Gains> kGains{{800, 8.5, 1e-4, 1.5e-3}, {800, 3.3, 1e-4, 1.5e-3}, {200, 3.3, 1e-4, 1.5e-3},
                                {3000, 8.5, 1e-4, 1e-3},  {800, 1, 5e-5, 1.5e-3},   {800, 8.5, 1e-7, 1.5e-3},
                                {800, 3.3, 1e-4, 4e-4}};

TEST_CASE("compensated spring: its pull is the inverse of its extension") {
  constexpr double kRounding = 1e-9;  // [of the greatest pull]
  Figures off;
  for (const Gains& g : kGains) {
    const CompensatedSpring spring = g.spring();
    CHECK(g.held(g.yield) == doctest::Approx(g.most));
    for (int i = 0; i <= 1000; ++i) {
      const double d = g.yield * i / 1000;
      off.add(std::abs(spring.at(g.extension(d)).pull - g.held(d)) / g.most);
    }
    // Below δ₀ as well.
    for (double d = g.first_depth(); d > 1e-3 * g.first_depth(); d /= 2)
      off.add(std::abs(spring.at(g.extension(d)).pull - g.held(d)) / g.most);
  }
  MESSAGE("pull off, of the greatest: ", off);
  CHECK(off.worst() <= kRounding);
}

// The two in series give way by x + δ = P / k + δ δ₀² / (δ² + δ₀²). At δ = n δ₀ the last is the share
// 1 / (n (n² + 1) (1 − δ / R)) of P / k, and its slope the share (n² − 1) / (n (n² + 1)² (2 − 3 δ / R)) of 1 / k: with
// δ up to R / 4, .13 % at 10 δ₀ and less from there on.
TEST_CASE("compensated spring: in series with the contact the stiffness is k from 10 times its first depth on") {
  constexpr double kStiffnessError = 1.4e-3, kRounding = 1e-9;
  Figures tangent, secant, over;
  for (const Gains& g : kGains) {
    const CompensatedSpring spring = g.spring();
    const double d0 = g.first_depth(), from = d0 / 10;
    REQUIRE(10 * d0 < g.yield);
    for (int i = 0; i < 600; ++i) {
      const double d = from * std::pow(g.yield / from, i / 600.0), n = d / d0, share = d / g.radius;
      const double x = g.extension(d), P = g.held(d);
      const SpringPull p = spring.at(x);
      const double contact = 1 / (g.c() * d * (2 * g.radius - 3 * d));  // dδ/dP
      // Compliance over 1 / k, less what the formula leaves.
      const double of_secant = g.k * (x + d) / p.pull - 1, of_tangent = g.k * (1 / p.tangent + contact) - 1;
      const double sum = n * n + 1;
      const double left_secant = 1 / (n * sum * (1 - share));
      const double left_tangent = (1 - n * n) / (n * sum * sum * (2 - 3 * share));
      over.add(std::abs(of_secant - left_secant) / (1 + left_secant));
      over.add(std::abs(of_tangent - left_tangent) / (1 + std::abs(left_tangent)));
      over.add(std::abs(p.pull - P) / P);
      if (n < 10) continue;
      tangent.add(std::abs(1 / (1 + of_tangent) - 1));
      secant.add(std::abs(1 / (1 + of_secant) - 1));
    }
  }
  MESSAGE("in series, off k from 10 first depths on: tangent ", tangent, "; secant ", secant, "; off the formula ",
          over);
  CHECK(tangent.worst() <= kStiffnessError);
  CHECK(secant.worst() <= kStiffnessError);
  CHECK(over.worst() <= kRounding);
}

/// Checks that a spring's pull and energy are what its tangent and pull add up to, along extensions past saturation.
template <class Spring>
void check_adds_up(const Spring& spring, double k, double most, double stiffest, double saturated) {
  // Simpson's rule on smooth laws over 20000 steps; across the kink where the pull saturates one step is off by its
  // square.
  constexpr double kSumError = 1e-7, kDifferenceError = 1e-5, kRounding = 1e-9;
  constexpr int kSteps = 20000;
  const double far = 3 * saturated, step = far / kSteps;
  double energy = 0, before = 0;
  int wrong = 0;
  Figures energy_off, tangent_off;
  for (int i = 1; i <= kSteps; ++i) {
    const double x = i * step;
    const SpringPull a = spring.at(x - step), m = spring.at(x - step / 2), b = spring.at(x);
    energy += step / 6 * (a.pull + 4 * m.pull + b.pull);
    energy_off.add(std::abs(b.energy - energy) / (most * far));
    wrong += b.pull >= before && b.pull <= most && b.tangent >= 0 && b.tangent <= stiffest * (1 + kRounding) ? 0 : 1;
    before = b.pull;
    const double d = 1e-3 * step;
    const bool kink = std::abs(x - saturated) < step;
    // Where the curve bends most, at rest, it does so over some δ₀.
    if (!kink && i > 40)
      tangent_off.add(std::abs((spring.at(x + d).pull - spring.at(x - d).pull) / (2 * d) - b.tangent) / k);
  }
  CHECK(wrong == 0);
  CHECK(spring.at(0).pull <= kRounding * most);
  CHECK(spring.at(0).energy == doctest::Approx(0));
  CHECK(spring.at(saturated * 1.001).pull == most);
  CHECK(spring.at(saturated * 0.99).pull < most);
  CHECK(spring.at(saturated * 1.001).tangent == 0);
  MESSAGE("energy off the sum of pulls, of pull times way: ", energy_off, "; tangent off, of k: ", tangent_off);
  CHECK(energy_off.worst() <= kSumError);
  CHECK(tangent_off.worst() <= kDifferenceError);
}

TEST_CASE("compensated spring: energy is the sum of pulls, tangent their slope, pull rises to the most and stays") {
  for (const Gains& g : kGains) {
    CAPTURE(g.k);
    CAPTURE(g.most);
    // In series with a contact that is softest, at .7 δ₀, the spring is 2.23 times as stiff as k.
    check_adds_up(g.spring(), g.k, g.most, 2.3 * g.k, g.extension(g.yield));
    CHECK(g.spring().at(0).tangent == g.k);
  }
}

TEST_CASE("bounded spring: energy is the sum of pulls, tangent their slope, pull rises to the most and stays") {
  check_adds_up(BoundedSpring{0.3, 0.188}, 0.3, 0.188, 0.3, 0.188 / 0.3);
  const BoundedSpring spring{2, 6};
  CHECK(spring.at(1).pull == 2);
  CHECK(spring.at(1).energy == 1);
  CHECK(spring.at(5).pull == 6);
  CHECK(spring.at(5).energy == 21);
}

}  // namespace
