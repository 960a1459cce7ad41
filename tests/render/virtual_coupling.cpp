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
  double k, most, yield;
};
// Of the default, soft, hard, a device of little force, and no yield next to the coupling's own.
const std::vector<Gains> kGains{{800, 8.5, 1e-4},  {800, 3.3, 1e-4}, {200, 3.3, 1e-4},
                                {3000, 8.5, 1e-4}, {800, 1, 5e-5},   {800, 8.5, 1e-7}};

double first_force(const Gains& g) { return 4 * (g.k * g.yield) * (g.k * g.yield) / g.most; }

/// Extension under P as the header defines it.
double extension_of(const Gains& g, double P) {
  return P / g.k - g.yield * P / std::sqrt(g.most * (P + first_force(g)));
}

TEST_CASE("compensated spring: its pull is the inverse of its extension") {
  constexpr double kRounding = 1e-9;  // [of the greatest pull]
  Figures off;
  for (const Gains& g : kGains) {
    const CompensatedSpring spring{g.k, g.most, g.yield};
    for (int i = 0; i <= 1000; ++i) {
      const double P = g.most * i / 1000;
      off.add(std::abs(spring.at(extension_of(g, P)).pull - P) / g.most);
    }
    // Below P₀ as well.
    for (double P = first_force(g); P > 1e-9 * g.most; P /= 2)
      off.add(std::abs(spring.at(extension_of(g, P)).pull - P) / g.most);
  }
  MESSAGE("pull off, of the greatest: ", off);
  CHECK(off.worst() <= kRounding);
}

// A contact yields by δ_m √(P / P_m); in series with it the spring has the stiffness k. At n P₀ the extension of the
// two is off P / k by (1 − √(n / (n + 1))) / (2 √n) of it, which is less than 1 / (4 n^1.5): .8 % at 10 P₀, .1 % from
// 40 P₀ on.
TEST_CASE("compensated spring: in series with the contact the stiffness is k from 40 P0 on") {
  constexpr double kStiffnessError = 1e-3, kEarlyError = 8e-3, kRounding = 1e-9;
  Figures tangent, secant, early, over;
  for (const Gains& g : kGains) {
    const CompensatedSpring spring{g.k, g.most, g.yield};
    const double first = first_force(g), from = 10 * first;
    REQUIRE(40 * first < g.most);
    for (int i = 0; i < 400; ++i) {
      const double P = from * std::pow(g.most / from, i / 400.0), n = P / first;
      const SpringPull p = spring.at(extension_of(g, P));
      const double contact = g.yield / (2 * std::sqrt(P * g.most));  // dδ/dP
      const double by_tangent = std::abs(1 / (1 / p.tangent + contact) / g.k - 1);
      const double by_secant = std::abs(P / (extension_of(g, P) + g.yield * std::sqrt(P / g.most)) / g.k - 1);
      early.add(std::max(by_tangent, by_secant));
      over.add(std::max(by_tangent, by_secant) - 1 / (4 * n * std::sqrt(n)));
      if (n < 40) continue;
      tangent.add(by_tangent);
      secant.add(by_secant);
    }
  }
  MESSAGE("in series, off k from 40 P0 on: tangent ", tangent, "; secant ", secant, "; from 10 P0 on ", early);
  CHECK(tangent.worst() <= kStiffnessError);
  CHECK(secant.worst() <= kStiffnessError);
  CHECK(early.worst() <= kEarlyError);
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
    // Where the curve bends most, at rest, it does so over P₀ / k.
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
    check_adds_up(CompensatedSpring{g.k, g.most, g.yield}, g.k, g.most, 2 * g.k, extension_of(g, g.most));
    CHECK(CompensatedSpring{g.k, g.most, g.yield}.at(0).tangent >= g.k);
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
