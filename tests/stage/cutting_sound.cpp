// SPDX-License-Identifier: MIT
// The sound of cutting: its lines against the vibration's, and silence of clicks.
#include "support/cases.hpp"
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"
#include "support/spectrum.hpp"

#include <trephine/stage/cutting_sound.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 5150;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kNoPath = std::numeric_limits<double>::infinity();

/// Samples of a sound, `n` by buffers of `buffer`.
std::vector<double> listen(CuttingSound& sound, double rate, int n, std::size_t buffer = 256) {
  std::vector<float> out(buffer);
  std::vector<double> all;
  while (static_cast<int>(all.size()) < n) {
    sound.fill(out, rate);
    all.insert(all.end(), out.begin(), out.end());
  }
  all.resize(static_cast<std::size_t>(n));
  return all;
}

TEST_CASE("cutting sound: below 1 kHz its lines are the vibration's, at any audio rate; no line is above 0.4 of it") {
  CAPTURE(kSeed);
  Random random(kSeed);
  double off = 0, others = -1e3;
  int count = 0;
  for (int run = 0; run < cases(24); ++run) {
    const double rate = run % 3 == 0 ? 44.1e3 : run % 3 == 1 ? 48e3 : 96e3;
    const CuttingSoundState state{.spindle = rpm(5e3 * std::pow(run < 16 ? 4 : 16, random.uniform())),
                                  .load = random.uniform(1e-3, 0.02),
                                  .teeth = 2 + random.below(run < 16 ? 5 : 15)};
    const CuttingSound::Options options{.gain = random.uniform(1, 50),
                                        .pattern = {.arc = random.uniform(0.2, 1), .runout = run % 2 == 0 ? 0 : 0.3},
                                        .corner = kNoPath};
    Mailbox<CuttingSoundState> box;
    CuttingSound sound(options, box);
    box.post(state);
    static_cast<void>(listen(sound, rate, 512));  // the start fades in
    const int n = run < 16 ? 8192 : 4096;
    const Spectrum heard(listen(sound, rate, n));
    // The same teeth in the hand at 10 kHz, for a torque of `load` times `gain`.
    const ToothLines lines(state.teeth, options.pattern);
    std::vector<double> felt;
    for (int i = 0; i < n; ++i)
      felt.push_back(options.gain * state.load * lines.sample(state.spindle * i * 1e-4, state.spindle * 1e-4));
    const Spectrum in_hand(felt);
    const double one = state.spindle / kTurn;
    double loudest = 0;
    for (int order = 1; order * one < 1000; ++order) {
      const double a = heard.at(order * one / rate), b = in_hand.at(order * one / 10e3);
      loudest = std::max(loudest, a);
      if (!(b > 1e-2 * options.gain * state.load)) continue;
      off = std::max(off, std::abs(decibel(a / b)));
      ++count;
    }
    double strongest = 0, most = 0;
    for (int i = Spectrum::kLobe + 1; i < heard.bins(); ++i) {
      const double at = i / static_cast<double>(n), apart = (Spectrum::kLobe + 0.5) / n;
      const bool near = std::abs(std::remainder(at, one / rate)) < apart && at < 0.4 + apart;
      double& kind = near ? strongest : most;
      kind = std::max(kind, heard.bin(i));
    }
    others = std::max(others, decibel(most / strongest));
  }
  MESSAGE(count, " lines off the vibration's by at most [dB] ", off, "; others below the strongest [dB] ", others);
  CHECK(count > cases(24) / 2);
  CHECK(off < 0.0012);
  CHECK(others < -80);
}

TEST_CASE("cutting sound: no state makes a click") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  constexpr double rate = 48e3;
  constexpr std::size_t buffer = 128;
  const CuttingSound::Options options{.gain = 10, .pattern = {.arc = 0.8, .runout = 0.2, .spread = 0.3}};
  Mailbox<CuttingSoundState> box;
  CuttingSound sound(options, box);
  std::array<float, buffer> out{};
  double last = 0, closest = 0, loudest = 0;
  CuttingSoundState before{}, now{};
  int over = 0;
  for (int n = 0; n < cases(3000); ++n) {
    const CuttingSoundState older = before;
    before = now;
    now = {.spindle = random.below(5) == 0 ? 0 : rpm(random.uniform(0, 60e3)),
           .load = random.below(4) == 0 ? 0 : random.uniform(0, 0.02),
           .teeth = random.below(8) == 0 ? random.below(17) : now.teeth};
    box.post(now);
    sound.fill(out, rate);
    // Each line moves by no more than its order times the fastest angle, and a ramp of load and weights.
    double most_load = 0, fastest = 0, step = 0;
    for (const auto& s : {older, before, now}) {
      most_load = std::max(most_load, s.load);
      fastest = std::max(fastest, s.spindle / rate);
    }
    for (const auto& s : {older, before, now}) {
      const ToothLines lines(s.teeth, options.pattern);
      double slopes = options.pattern.runout * fastest, peak = lines.peak(0);
      // The path's slope is at most 1.4 by its corner.
      const double by_weights = 5 / kTurn + 1.4 * rate / (kTurn * options.corner);
      const auto add = [&](double share, int k, double order) {
        const double x = k * options.pattern.arc / 2, q = 2 * x / std::numbers::pi;
        const double a = share * std::abs(2 * std::cos(x) / (1 - q * q));
        slopes += a * (std::min({order * fastest, 0.4 * kTurn, 2.0}) +
                       by_weights * order * fastest / static_cast<double>(buffer));
      };
      for (int m = 1; m <= ToothLines::kHarmonics; ++m) {
        if (s.teeth > 0) add(1.2, m * s.teeth, m * s.teeth + 1);
        if (s.teeth != 1)
          add(s.teeth > 0 ? options.pattern.spread / std::sqrt(s.teeth) : 1 / std::sqrt(CuttingEdges::kGrains), m, m);
      }
      step = std::max(step, options.gain * most_load * (slopes + peak / static_cast<double>(buffer)));
    }
    for (const float v : out) {
      const double change = std::abs(static_cast<double>(v) - last);
      over += change > step + 1e-6;
      if (step > 0) closest = std::max(closest, change / step);
      loudest = std::max(loudest, std::abs(static_cast<double>(v)));
      last = static_cast<double>(v);
    }
  }
  MESSAGE("largest step by its bound ", closest, "; loudest ", loudest);
  CHECK(over == 0);
  CHECK(closest > 0.3);
  CHECK(loudest > 0.05);
}

TEST_CASE(
    "cutting sound: a load starts and ends at 0, other teeth after a buffer, and the pitch falls with the spindle") {
  Mailbox<CuttingSoundState> box;
  CuttingSound sound({.gain = 10}, box);
  std::array<float, 480> out{};
  const auto fill = [&] {
    out.fill(9);
    sound.fill(out, 48e3);
    return *std::max_element(out.begin(), out.end());
  };
  CHECK(fill() == 0);
  box.post({.spindle = 600, .load = 0.01, .teeth = 6});
  CHECK(fill() > 0.02F);
  CHECK(std::abs(out[0]) < 1e-3F);
  CHECK(fill() > 0.05F);
  const auto pitch = [&] {
    const Spectrum s(listen(sound, 48e3, 9600));
    int best = Spectrum::kLobe + 1;
    for (int i = best; i < s.bins(); ++i)
      if (s.bin(i) > s.bin(best)) best = i;
    return best * 5.0;  // [Hz]
  };
  CHECK(pitch() == near(6 * 600 / kTurn, 0.01));
  box.post({.spindle = 500, .load = 0.01, .teeth = 6});
  static_cast<void>(fill());
  CHECK(pitch() == near(6 * 500 / kTurn, 0.01));
  box.post({.spindle = 500, .load = 0.01, .teeth = 9});
  static_cast<void>(fill());
  CHECK(std::abs(out.back()) == 0);
  static_cast<void>(fill());
  CHECK(pitch() == near(9 * 500 / kTurn, 0.005));
  box.post({.spindle = 500, .load = 0, .teeth = 9});
  static_cast<void>(fill());
  CHECK(out.back() == 0);
  CHECK(fill() == 0);
}

TEST_CASE("cutting sound: load and speed go in straight lines from state to state") {
  constexpr double rate = 48e3, slow = 400, fast = 900;
  constexpr int n = 300;
  const ToothPattern pattern{.arc = 0.5, .runout = 0.1};
  Mailbox<CuttingSoundState> box;
  CuttingSound sound({.gain = 2, .pattern = pattern, .corner = kNoPath}, box);
  const ToothLines lines(5, pattern);
  std::array<float, n> out{};
  double worst = 0;
  const auto check = [&](double start, double from, double to, double load_from, double load_to) {
    sound.fill(out, rate);
    for (int i = 1; i <= n; ++i) {
      const double part = i / static_cast<double>(n), speed = from + part * (to - from);
      const double angle = start + (from * i + (to - from) * i * (i + 1) / 2.0 / n) / rate;
      const double expected = 2 * (load_from + part * (load_to - load_from)) * lines.sample(angle, speed / rate);
      worst = std::max(worst, std::abs(static_cast<double>(out[static_cast<std::size_t>(i - 1)]) - expected));
    }
  };
  box.post({.spindle = slow, .load = 0.02, .teeth = 5});
  check(0, slow, slow, 0, 0.02);
  box.post({.spindle = fast, .load = 0.01, .teeth = 5});
  check(n * slow / rate, slow, fast, 0.02, 0.01);
  check((n * slow + n * slow + (fast - slow) * (n + 1) / 2.0) / rate, fast, fast, 0.01, 0.01);
  CHECK(worst < 1e-8);
}

TEST_CASE("cutting sound: takes a report, refuses what is no number, and allocates nothing") {
  CuttingReport report;
  report.spindle = 300;
  report.torque = 0.004;
  const CuttingSoundState of_flutes = sound_of(report, {.flutes = 7});
  CHECK(of_flutes.spindle == 300);
  CHECK(of_flutes.load == 0.004);
  CHECK(of_flutes.teeth == 7);
  CHECK(sound_of(report, {.kind = CuttingEdges::Kind::kDiamond}).teeth == 0);

  Mailbox<CuttingSoundState> box;
  CuttingSound sound({}, box);
  std::array<float, 64> out{};
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto finite = [&] { return std::all_of(out.begin(), out.end(), [](float v) { return std::isfinite(v); }); };
  for (const double bad : {nan, inf, -1.0}) {
    box.post({.spindle = bad, .load = 1, .teeth = 4});
    sound.fill(out, 48e3);
    CHECK(finite());
    box.post({.spindle = 1, .load = bad, .teeth = 4});
    sound.fill(out, 48e3);
    CHECK(finite());
    box.post(of_flutes);
    sound.fill(out, bad);
    CHECK(finite());
  }
  box.post({.spindle = 400, .load = 0.01, .teeth = -3});
  sound.fill(out, 48e3);
  CHECK(finite());
  sound.fill({}, 48e3);
  box.post(of_flutes);
  const auto calls = heap_calls([&] {
    for (int i = 0; i < 100; ++i) sound.fill(out, 44.1e3);
  });
  CHECK(calls == 0);
  static_assert(noexcept(sound.fill(out, 1.0))&& noexcept(box.post(of_flutes)));

  check_refused("gain", [&] { CuttingSound({.gain = -1}, box); });
  check_refused("gain", [&] { CuttingSound({.gain = nan}, box); });
  check_refused("arc", [&] { CuttingSound({.pattern = {.arc = 4}}, box); });
  for (const double bad : {0.0, -1.0, nan}) check_refused("corner", [&] { CuttingSound({.corner = bad}, box); });
}

}  // namespace
