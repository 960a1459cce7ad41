// SPDX-License-Identifier: MIT
// Lines of cutting teeth: their spectrum by its definition, against a train of half sines.
#include "support/cases.hpp"
#include "support/check_refused.hpp"
#include "support/figures.hpp"
#include "support/random.hpp"
#include "support/spectrum.hpp"

#include <trephine/tool/tooth_lines.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 4041;
constexpr double kTurn = 2 * std::numbers::pi;

/// Force of z teeth over its mean, less 1, at the spindle's angle: each cuts a half sine about an angle of 0.
double train(int z, const ToothPattern& p, double theta) {
  double sum = 0;
  for (int k = 0; k < z; ++k) {
    const double at = std::remainder(theta + kTurn * k / z, kTurn);
    if (std::abs(at) < p.arc / 2) sum += std::cos(std::numbers::pi * at / p.arc);
  }
  const double mean = z * p.arc * 2 / std::numbers::pi / kTurn;
  return (z > 1 ? 1 + p.runout * std::cos(theta) : 1) * sum / mean - 1;
}

/// Amplitude of order k in the train, by quadrature over a turn.
double amplitude_by_quadrature(int z, const ToothPattern& p, int k) {
  constexpr int n = 1 << 14;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += train(z, p, kTurn * (i + 0.5) / n) * std::cos(k * kTurn * (i + 0.5) / n);
  return 2 * sum / n;
}

/// Spindle, loop and teeth of a run at constant speed.
struct Run {
  int teeth = 8;
  ToothPattern pattern{};
  double turns = 0;  // of the spindle in a sample
  double theta = 0;
  [[nodiscard]] std::vector<double> sampled(int n) const {
    const ToothLines lines(teeth, pattern);
    std::vector<double> x(static_cast<std::size_t>(n));
    double at = theta;
    for (double& v : x) {
      at = std::fmod(at + kTurn * turns, kTurn);
      v = lines.sample(at, kTurn * turns);
    }
    return x;
  }
  /// Orders that may have a line.
  [[nodiscard]] bool has(int order) const {
    const int rest = order % teeth;
    if (rest == 0) return true;
    return pattern.runout > 0 && teeth > 1 && (order == 1 || rest == 1 || rest == teeth - 1);
  }
};

TEST_CASE("tooth lines: below a tenth of the rate each is the train's Fourier coefficient, and nothing else is there") {
  CAPTURE(kSeed);
  Random random(kSeed);
  Figures off, elsewhere, aliases;
  int lines_seen = 0, still = 0;
  for (int run = 0; run < cases(480); ++run) {
    const double rate = run % 4 == 0 ? 4e3 : run % 4 == 1 ? 1e3 : 10e3;
    const double speed = 5e3 / 60 * std::pow(16, random.uniform());  // [Hz]: 5 000 to 80 000 rpm
    Run of{.teeth = 2 + random.below(15), .turns = speed / rate, .theta = random.uniform(0, kTurn)};
    of.pattern.arc = random.uniform(0.1, std::numbers::pi);
    if (run % 8 >= 4) of.pattern.runout = random.uniform(0.05, 1);
    CAPTURE(rate);
    CAPTURE(speed);
    CAPTURE(of.teeth);
    CAPTURE(of.pattern.arc);
    CAPTURE(of.pattern.runout);
    const std::vector<double> x = of.sampled(2048);
    const bool any = speed * (of.pattern.runout > 0 ? 1 : of.teeth) < ToothLines::kSilent * rate;
    if (!any) {
      CHECK(std::all_of(x.begin(), x.end(), [](double v) { return v == 0; }));
      ++still;
      continue;
    }
    const Spectrum spectrum(x);
    std::vector<double> at;  // frequencies of lines, by the rate
    double strongest = 0;
    for (int order = 1; order * of.turns < 0.5; ++order) {
      if (!of.has(order) || order > (ToothLines::kHarmonics + 1) * of.teeth) continue;
      at.push_back(order * of.turns);
      strongest = std::max(strongest, spectrum.at(at.back()));
    }
    for (int order = 1; order * of.turns < 0.5; ++order) {
      if (!of.has(order) || order * of.turns > ToothLines::kWhole) continue;
      if (order > (ToothLines::kHarmonics - 1) * of.teeth) continue;
      const double expected = std::abs(amplitude_by_quadrature(of.teeth, of.pattern, order));
      if (expected < 1e-3 * strongest) continue;
      const double error = std::abs(decibel(spectrum.at(order * of.turns) / expected));
      CHECK(error < 2e-3);  // dB
      off.add(error);
      ++lines_seen;
    }
    if (!(strongest > 1e-6)) continue;
    const auto far_from_lines = [&](double f) {
      return std::none_of(at.begin(), at.end(),
                          [&](double l) { return std::abs(f - l) * 2048 < Spectrum::kLobe + 0.5; });
    };
    double most = 0;
    for (int i = 0; i < spectrum.bins(); ++i)
      if (far_from_lines(i / 2048.0)) most = std::max(most, spectrum.bin(i));
    elsewhere.add(decibel(std::max(most, 1e-9 * strongest) / strongest));
    CHECK(most < 7e-5 * strongest);  // −83 dB
    // Where orders above half the rate would come back.
    for (int m = 1; m <= 64; ++m) {
      const double alias = std::abs(std::remainder(m * of.teeth * of.turns, 1.0));
      if (m * of.teeth * of.turns < 0.5 || !far_from_lines(alias)) continue;
      const double level = spectrum.at(alias);
      aliases.add(decibel(std::max(level, 1e-9 * strongest) / strongest));
      CHECK(level < 7e-5 * strongest);  // −83 dB
    }
  }
  CHECK(lines_seen > cases(480) / 2);
  CHECK(still > 0);
  MESSAGE(lines_seen, " lines off their coefficient by [dB] ", off, "; other bins below the strongest line [dB] ",
          elsewhere, "; aliases [dB] ", aliases, "; runs beyond the band, exactly 0: ", still);
}

TEST_CASE("tooth lines: a slow spindle gives the train itself") {
  Random random(kSeed + 1);
  for (const int z : {1, 2, 3, 8}) {
    for (const double runout : {0.0, 0.4}) {
      const ToothPattern p{.arc = 2.2, .runout = runout};
      const ToothLines lines(z, p);
      for (int i = 0; i < 200; ++i) {
        const double theta = random.uniform(0, kTurn);
        // The rest of the series falls as the square of the order.
        const double rest = (1 + runout) * 2 * std::pow(std::numbers::pi / (z * p.arc), 2) / ToothLines::kHarmonics;
        CHECK(std::abs(lines.sample(theta, 1e-5) - train(z, p, theta)) < 1.1 * rest);
      }
    }
  }
  // Teeth that follow each other in a slot: a force that never changes, but for chips of two teeth.
  CHECK(ToothLines(8, {.arc = std::numbers::pi}).peak(0) < 0.1);
}

TEST_CASE("tooth lines: weights are 1 in the band, 0 before aliases, and change smoothly") {
  const auto weight = [](double part) { return ToothLines::weight(part * kTurn); };
  constexpr int n = 5000;
  for (int i = 0; i < n; ++i) {
    const double part = 0.5 * i / n, step = 0.5 / n;
    CHECK(weight(part) >= weight(part + step));
    CHECK(weight(part) - weight(part + step) <= 5 * step * (1 + 1e-6));
    if (part <= 0.1) CHECK(weight(part) == 1);
    if (part >= 0.4) CHECK(weight(part) == 0);
  }
  for (const double big : {0.5, 1.0, 7.3, 1e30}) CHECK(weight(big) == 0);
  CHECK(weight(std::numeric_limits<double>::quiet_NaN()) == 0);
}

TEST_CASE("tooth lines: a spindle that runs up makes no step larger than its lines' slopes") {
  double worst = 0;
  int steps_over = 0, peaks_over = 0;
  for (const int z : {2, 5, 8, 16}) {
    for (const double runout : {0.0, 0.5}) {
      const ToothPattern p{.arc = 0.7, .runout = runout};
      const ToothLines lines(z, p);
      std::vector<double> amplitude;
      for (int m = 1; m <= ToothLines::kHarmonics; ++m)
        amplitude.push_back(std::abs(amplitude_by_quadrature(z, {.arc = p.arc}, m * z)));
      for (const double rate : {1e3, 10e3}) {
        const int n = static_cast<int>(2 * rate);
        const double faster = 80e3 / 60 * kTurn / n / rate;  // rise of the advance in a sample
        double theta = 0, advance = 0, before = lines.sample(0, 0);
        for (int i = 1; i <= n; ++i) {
          advance += faster;
          theta += advance;
          const double now = lines.sample(theta, advance);
          // A line of order k and amplitude a moves by a k·advance at most; its weight changes by 5 times k·faster/2π.
          const auto slope = [&](double order) {
            const bool sounds = order * (advance - faster) < 0.4 * kTurn;
            return sounds ? order * (advance + 5 * faster / kTurn) : 0.0;
          };
          double bound = runout * slope(1) + 1e-9;
          for (int m = 1; m <= ToothLines::kHarmonics; ++m) {
            const double a = amplitude[static_cast<std::size_t>(m - 1)];
            bound += a * (slope(m * z) + runout / 2 * (slope(m * z - 1) + slope(m * z + 1)));
          }
          if (bound < 2 * lines.peak(advance)) worst = std::max(worst, std::abs(now - before) / bound);
          steps_over += std::abs(now - before) > bound;
          peaks_over += std::abs(now) > lines.peak(advance) * (1 + 1e-12);
          before = now;
        }
      }
    }
  }
  MESSAGE("largest step by its bound: ", worst);
  CHECK(steps_over == 0);
  CHECK(peaks_over == 0);
  CHECK(worst > 0.5);
}

/// Amplitudes of the spindle's orders 1 to n in a force by the spindle's angle.
template <class Force>
std::vector<double> orders_of(int n, const Force& force) {
  constexpr int kPoints = 512;
  std::vector<std::complex<double>> sums(static_cast<std::size_t>(n));
  for (int i = 0; i < kPoints; ++i) {
    const double theta = kTurn * (i + 0.5) / kPoints, now = force(theta);
    for (int k = 1; k <= n; ++k) sums[static_cast<std::size_t>(k - 1)] += std::polar(2 * now / kPoints, -k * theta);
  }
  std::vector<double> out;
  for (const auto& sum : sums) out.push_back(std::abs(sum));
  return out;
}

TEST_CASE("tooth lines: unequal teeth, and a diamond's grains anywhere, have the lines of such burrs in the mean") {
  CAPTURE(kSeed);
  Random random(kSeed + 3);
  constexpr int kOrders = 24;
  const int burrs = cases(2000);
  double off = 0;
  for (const int z : {0, 3, 8}) {
    const ToothPattern p{.arc = 0.6, .spread = 0.4};
    const ToothLines lines(z, p);
    const std::vector<double> got = orders_of(kOrders, [&](double theta) { return lines.sample(theta, 1e-4); });
    // Force of half sines at given angles with given shares, over its mean.
    const int count = z > 0 ? z : CuttingEdges::kGrains;
    std::vector<double> squares(kOrders);
    for (int burr = 0; burr < burrs; ++burr) {
      std::vector<std::complex<double>> turns(kOrders);
      for (int j = 0; j < count; ++j) {
        const double at = z > 0 ? kTurn * j / z : random.uniform(0, kTurn);
        const double share = z > 0 ? 1 + p.spread * random.normal() : 1;
        for (int k = 1; k <= kOrders; ++k) turns[static_cast<std::size_t>(k - 1)] += std::polar(share / count, k * at);
      }
      for (std::size_t k = 0; k < kOrders; ++k) squares[k] += std::norm(turns[k]) / burrs;
    }
    for (int k = 1; k <= kOrders; ++k) {
      CAPTURE(z);
      CAPTURE(k);
      // Where equal teeth have a line, the spread's share of it is left out.
      const bool of_equal_teeth = z > 0 && k % z == 0;
      const double pulse = std::abs(amplitude_by_quadrature(1, {.arc = p.arc}, k));
      const double share = of_equal_teeth ? 1 : std::sqrt(squares[static_cast<std::size_t>(k - 1)]);
      const double error = got[static_cast<std::size_t>(k - 1)] / (pulse * share) - 1;
      CHECK(std::abs(error) < 0.07);
      off = std::max(off, std::abs(error));
    }
  }
  MESSAGE("off the root mean square of ", burrs, " burrs by at most ", off);
}

TEST_CASE("tooth lines: a filter weighs each line by its frequency") {
  const ToothPattern p{.arc = 0.7, .runout = 0.3, .spread = 0.5};
  for (const int z : {0, 1, 6}) {
    const ToothLines lines(z, p);
    const double advance = 1e-3;
    const auto below = [&](double angle) { return angle < 9.5 * advance ? 1.0 : 0.0; };
    const std::vector<double> all = orders_of(32, [&](double theta) { return lines.sample(theta, advance); });
    const std::vector<double> low = orders_of(32, [&](double theta) { return lines.sample(theta, advance, below); });
    for (std::size_t k = 1; k <= 32; ++k) CHECK(std::abs(low[k - 1] - (k < 10 ? all[k - 1] : 0)) < 1e-12);
  }
}

TEST_CASE("tooth lines: sums stay within their bound, however long and whatever they weigh") {
  CAPTURE(kSeed);
  Random random(kSeed + 2);
  Figures constant;
  for (int run = 0; run < cases(160); ++run) {
    const int z = random.below(17);
    const ToothPattern p{.arc = random.uniform(0.1, 3),
                         .runout = run % 2 == 0 ? 0 : random.uniform(),
                         .spread = run % 4 < 2 ? 0 : random.uniform()};
    const ToothLines lines(z, p);
    const double advance = random.uniform(1e-3, 0.35 * kTurn / std::max(z, 1));
    const double bound = lines.sum_bound(advance), peak = lines.peak(advance);
    double theta = random.uniform(0, kTurn), sum = 0, worst = 0;
    int over = 0;
    double u = random.normal(), weighed = 0, variation = 0, size = 0;
    for (int i = 0; i < 5000; ++i) {
      theta += advance;
      const double x = lines.sample(theta, advance);
      sum += x;
      worst = std::max(worst, std::abs(sum));
      weighed += u * x;
      size += std::abs(u);
      over += std::abs(weighed) > std::min(bound * (std::abs(u) + variation), peak * size) + 1e-9;
      const double next = u + 0.02 * random.normal();
      variation += std::abs(next - u);
      u = next;
    }
    CHECK(over == 0);
    CHECK(worst <= bound + 1e-9);
    if (bound > 0) constant.add(worst / bound);
  }
  MESSAGE("sums by their bound: ", constant);
  CHECK(constant.worst() > 0.9);
}

TEST_CASE("tooth lines: edges without teeth or with one, and refusals") {
  const CuttingEdges diamond{.kind = CuttingEdges::Kind::kDiamond, .flutes = 0};
  CHECK(ToothLines(diamond, {.spread = 1}).sample(0.1, 0.01) == ToothLines(diamond, {}).sample(0.1, 0.01));
  CHECK(std::abs(ToothLines(diamond, {.runout = 0.3}).sample(0, 0.01) - ToothLines(diamond, {}).sample(0, 0.01) - 0.3) <
        1e-15);
  CHECK(ToothLines(1, {.spread = 1}).sample(0.2, 1e-3) == ToothLines(1, {}).sample(0.2, 1e-3));
  CHECK(ToothLines().sample(1, 0.1) == 0);
  CHECK(ToothLines(1, {.runout = 1}).sample(0.2, 1e-3) == ToothLines(1, {}).sample(0.2, 1e-3));
  CHECK(ToothLines(6, {}).sample(0.3, -0.02) == ToothLines(6, {}).sample(0.3, 0.02));  // turns either way
  // The arc at which the coefficient's formula is 0/0: x = π/2.
  const double arc = std::numbers::pi / 2;
  CHECK(std::abs(ToothLines(2, {.arc = arc}).sample(0.1, 0.3) - ToothLines(2, {.arc = arc + 1e-9}).sample(0.1, 0.3)) <
        5e-9);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, 3.2, nan}) check_refused("arc", [&] { ToothPattern{.arc = bad}.validate(); });
  for (const double bad : {-0.1, 1.1, nan}) check_refused("runout", [&] { ToothPattern{.runout = bad}.validate(); });
  for (const double bad : {-0.1, 1.1, nan}) check_refused("spread", [&] { ToothPattern{.spread = bad}.validate(); });
}

}  // namespace
