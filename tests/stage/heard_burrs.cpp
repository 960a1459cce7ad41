// SPDX-License-Identifier: MIT
// The sound of burrs beside measurements: its spectrum, and how loud it is by speed and kind of burr.
#include "pushed_cut.hpp"
#include "support/near.hpp"
#include "support/spectrum.hpp"

#include <trephine/stage/cutting_sound.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::cutting;

constexpr double kNoPath = std::numeric_limits<double>::infinity();
constexpr int kDiamond = 0;  // teeth

/// A-weighting (IEC 61672-1), as a factor.
double a_weight(double f) {
  const double f2 = f * f, low = 20.6 * 20.6, middle = 107.7 * 107.7, high = 737.9 * 737.9, top = 12194.0 * 12194.0;
  const double shape = top * f2 * f2 / ((f2 + low) * std::sqrt((f2 + middle) * (f2 + high)) * (f2 + top));
  return std::pow(10, 0.1) * shape;
}

/// Levels in the octaves of 4, 8 and 16 kHz [dBA] over speeds from 30 to 80 krpm, under a load of 1.
std::array<double, 3> octaves(int teeth, double rate, const CuttingSound::Options& options) {
  std::array<double, 3> power{};
  for (int hertz = 500; hertz <= 1330; hertz += 10) {
    Mailbox<CuttingSoundState> box;
    CuttingSound sound(options, box);
    box.post({.spindle = 2 * std::numbers::pi * hertz, .load = 1, .teeth = teeth});
    std::vector<float> out(static_cast<std::size_t>(rate / 10));
    sound.fill(out, rate);  // fades in
    sound.fill(out, rate);
    const Spectrum heard(std::vector<double>(out.begin(), out.end()));
    for (int order = 1; order * hertz < 0.4 * rate; ++order) {
      const double f = order * hertz, amplitude = a_weight(f) * heard.at(f / rate);
      for (std::size_t i = 0; i < 3; ++i) {
        const double by_centre = f / (4e3 * static_cast<double>(1 << i));
        if (by_centre >= std::numbers::sqrt2 / 2 && by_centre < std::numbers::sqrt2) power[i] += amplitude * amplitude;
      }
    }
  }
  std::array<double, 3> levels{};
  for (std::size_t i = 0; i < 3; ++i) levels[i] = 10 * std::log10(power[i]);
  return levels;
}

TEST_CASE(
    "heard burrs: over 30 to 80 krpm octaves fall as a burr's do on mastoid cortex, which its teeth alone do not") {
  // 6.5 mm on mastoid cortex: 108 dBA at 4 kHz, 84 at 8, 40 at 16 (Hilmi, Otol Neurotol).
  CHECK(a_weight(1000) == near(1, 1e-3));
  constexpr double kFirst = -24, kSecond = -44, kTolerance = 6;
  for (const int teeth : {8, kDiamond}) {
    CAPTURE(teeth);
    const auto say = [&](const std::string& what, const std::array<double, 3>& l) {
      MESSAGE(teeth, " teeth, ", what, ": ", l[1] - l[0], " dB from 4 to 8 kHz, ", l[2] - l[1], " dB to 16 kHz");
    };
    const auto heard = octaves(teeth, 96e3, {.gain = 1});
    say("heard", heard);
    CHECK(heard[1] - heard[0] == within(kFirst, kTolerance));
    CHECK(heard[2] - heard[1] == within(kSecond, kTolerance));
    const auto source = octaves(teeth, 96e3, {.gain = 1, .corner = kNoPath});
    say("without the path", source);
    CHECK(source[1] - source[0] > kFirst + 2 * kTolerance);
    CHECK(source[2] - source[1] > kSecond + 2 * kTolerance);
    const auto at_48 = octaves(teeth, 48e3, {.gain = 1});
    say("at 48 kHz", at_48);
    CHECK(at_48[1] - at_48[0] == within(kFirst, kTolerance));
    CHECK(at_48[2] < heard[2]);  // the band limit
  }
}

/// What is heard of a burr of 4 mm that is pushed into cortical bone.
struct Heard {
  double torque = 0;                       // mean [N·m]
  double peak = 0, level = 0, source = 0;  // [dB]: largest sample, root mean square with the path and without
};
Heard listen(const NamedTool& tool, double turns) {
  PushedCut cut({.layers = {{6e-3, 1700}}}, tool.tool, CuttingForce({.edges = tool.edges, .speed = rpm(turns)}),
                {.force = 3, .fastest = 4e-3});
  cut.go(1e-3);
  Mailbox<CuttingSoundState> heard_box, source_box;
  CuttingSound heard({}, heard_box), source({.corner = kNoPath}, source_box);
  std::array<float, 48> out{};
  Heard h;
  constexpr int kFade = 50, kTicks = 200;
  double peak = 0, heard_power = 0, source_power = 0;
  const auto power = [&] {
    double sum = 0;
    for (const float v : out) sum += static_cast<double>(v) * static_cast<double>(v);
    return sum / (kTicks * static_cast<double>(out.size()));
  };
  for (int i = 0; i < kFade + kTicks; ++i) {
    static_cast<void>(cut.tick(1e-3));
    const CuttingSoundState state = sound_of(cut.report(), tool.edges);
    heard_box.post(state);
    source_box.post(state);
    source.fill(out, 48e3);
    if (i >= kFade) source_power += power();
    heard.fill(out, 48e3);
    if (i < kFade) continue;
    heard_power += power();
    for (const float v : out) peak = std::max(peak, std::abs(static_cast<double>(v)));
    h.torque += cut.report().torque / kTicks;
  }
  CHECK(cut.status() == Status::kOk);
  h.peak = decibel(peak);
  h.level = 10 * std::log10(heard_power);
  h.source = 10 * std::log10(source_power);
  return h;
}

TEST_CASE("heard burrs: at one push a slower burr is louder, by the path alone") {
  // 4 mm burrs at 20, 50 and 80 krpm (Banakis Hartl et al., Otol Neurotol 2017, 38:938).
  constexpr std::array<double, 3> kTurns{20e3, 50e3, 80e3};
  std::array<std::array<Heard, 3>, 2> all{};
  for (std::size_t kind = 0; kind < 2; ++kind)
    for (std::size_t i = 0; i < 3; ++i) {
      const NamedTool tool = tool_by_name(kind == 0 ? "round-4" : "diamond-4");
      const Heard& h = all[kind][i] = listen(tool, kTurns[i]);
      MESSAGE((kind == 0 ? "cutting" : "diamond"), " at ", kTurns[i], " rpm: ", 1e3 * h.torque, " N mm, peak ", h.peak,
              " dB, level ", h.level, " dB, without the path ", h.source, " dB");
      if (i == 0) continue;
      const Heard& slower = all[kind][i - 1];
      CHECK(slower.level > h.level + 1);
      CHECK(slower.peak > h.peak + 1);
      CHECK(h.torque == near(slower.torque, 0.12));  // they are not equally deep
      CHECK(h.source == within(slower.source, 2));   // louder by the path alone
    }
  // Both kinds were measured alike. A diamond takes a third of the torque here, which is not mended by a wider bound.
}

}  // namespace
