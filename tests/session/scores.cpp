// SPDX-License-Identifier: MIT
// Scores of scripted sessions, whose values follow from formulas.
#include "logged.hpp"
#include "script.hpp"

#include <doctest/doctest.h>

#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/session/recorder.hpp>
#include <trephine/session/recording_file.hpp>

#include "device/archetypes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using test::append;
using test::lift;
using test::near;
using test::near_structure;
using test::scored;
using test::within;
using namespace std::chrono_literals;

constexpr double kClose = 0.01;  // [share] of a closed form: a tick is small beside the times below
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST_CASE("scores: time and bone in shells about a structure, and the breach at its end") {
  // From 6 mm down to 1 mm deep at 1 mm/s, 2 mm³ a second, a quarter of what is inside of the structure's own.
  std::vector<RecordedTick> ticks;
  append(ticks, 7, [](double t, RecordedTick& tick) {
    const double distance = 6e-3 - 1e-3 * (t - 0.5 * test::kTick);
    near_structure(tick, 2, distance);
    tick.result.removed_mm3 = 2 * test::kTick;
    if (distance < 0) tick.result.structures.taken_mm3 = 0.5 * test::kTick;
    tick.result.structures.refused_mm3 = 1e-4;
  });
  const Scores scores = scored(ticks);
  REQUIRE(scores.structures().size() == 16);
  for (const StructureScores& s : {scores.around_structures(), scores.structures()[2]}) {
    constexpr std::array<double, 4> widths{0.5, 0.5, 1, 2};
    for (std::size_t i = 0; i < 4; ++i) {
      CAPTURE(i);
      CHECK(s.shells[i].time == near(widths[i], kClose));
      CHECK(s.shells[i].removed_mm3 == near(2 * widths[i], kClose));
    }
    CHECK(s.inside.time == near(1, kClose));
    CHECK(s.inside.removed_mm3 == near(2, kClose));
    CHECK(s.distance == near(-1e-3, kClose));
    CHECK(s.breaches.count == 1);
    CHECK(s.breaches.time == near(1, kClose));
    CHECK(s.breach_depth == near(1e-3, kClose));
    CHECK(s.breached_mm3 == near(0.5, kClose));
    CHECK(s.over_limit.count == 0);
  }
  CHECK(scores.structures()[1].distance == kInfinity);
  CHECK(scores.structures()[1].inside.time == 0);
  CHECK(scores.totals().removed_mm3 == near(14));
  CHECK(scores.totals().refused_mm3 == near(0.7));
}

TEST_CASE("scores: breaches are apart by the gap, need a spindle that turns, and one of no known structure counts") {
  // In the structure for 0.2 s, out for 0.1 s, in for 0.2 s, out for 0.6 s, in for 0.2 s.
  const auto in_it = [](double t) { return t < 0.2 || (t > 0.3 && t < 0.5) || t > 1.1; };
  std::vector<RecordedTick> ticks;
  append(ticks, 1.3, [&](double t, RecordedTick& tick) {
    near_structure(tick, 0, in_it(t - 0.5 * test::kTick) ? -0.2e-3 : 0.2e-3);
  });
  CHECK(scored(ticks).around_structures().breaches.count == 2);
  CHECK(scored(ticks).around_structures().breaches.time == near(0.6, kClose));
  CHECK(scored(ticks, {.event_gap = 0.05}).structures()[0].breaches.count == 3);
  CHECK(scored(ticks, {.event_gap = 0.4}).structures()[0].breaches.count == 2);
  CHECK(scored(ticks, {.event_gap = 1}).structures()[0].breaches.count == 1);
  for (RecordedTick& tick : ticks) tick.input.spindle_on = false;
  CHECK(scored(ticks).around_structures().breaches.count == 0);
  CHECK(scored(ticks).around_structures().breach_depth == 0);
  CHECK(scored(ticks).around_structures().distance == -0.2e-3);

  // A cut may take bone of a structure in a scene that knows no distances.
  for (RecordedTick& tick : ticks) {
    tick.result.structures = {};
    tick.result.structures.taken_mm3 = 0.01;
  }
  const Scores unknown = scored(ticks);
  CHECK(unknown.around_structures().breaches.count == 1);
  CHECK(unknown.around_structures().breached_mm3 == near(13));
  CHECK(unknown.around_structures().distance == kInfinity);
  for (const StructureScores& s : unknown.structures()) CHECK(s.breaches.count == 0);

  // A number beyond the list is in the sum.
  ticks.clear();
  append(ticks, 1, [](double, RecordedTick& tick) { near_structure(tick, 7, 0.3e-3); });
  CHECK(scored(ticks, {.structures = 7}).around_structures().shells[0].time == near(1));
}

TEST_CASE("scores: near misses are ways to a structure and back, by their smallest distance") {
  using Misses = std::array<std::uint64_t, 4>;
  // Ways of a second each from 6 mm down to a depth and back, with a way between, all of structure 1.
  const auto ways = [](const std::vector<double>& nearest, bool spindle_on = true) {
    std::vector<RecordedTick> ticks;
    for (const double smallest : nearest)
      append(ticks, 1, [&](double t, RecordedTick& tick) {
        near_structure(tick, 1, smallest + (6e-3 - smallest) * std::abs(2 * t - 1));
        tick.input.spindle_on = spindle_on;
      });
    return ticks;
  };
  const Misses expected{1, 2, 0, 1};
  const std::vector<RecordedTick> five = ways({0.7e-3, 3e-3, 0.1e-3, 5e-3, 0.9e-3, 4e-3});
  const Scores scores = scored(five);
  CHECK(scores.structures()[1].near_misses == expected);
  CHECK(scores.around_structures().near_misses == expected);
  CHECK(scores.structures()[0].near_misses == Misses{});
  // A breach is no near miss; within the structure without the spindle there is none.
  CHECK(scored(ways({-0.1e-3, 3e-3, 5e-3})).structures()[1].near_misses == Misses{0, 0, 0, 1});
  CHECK(scored(ways({-0.1e-3, 3e-3, 5e-3}, false)).structures()[1].near_misses == Misses{1, 0, 0, 1});
  std::vector<RecordedTick> taken = ways({1.5e-3, 1.5e-3, 5e-3});
  taken[500].result.structures.taken_mm3 = 0.01;
  CHECK(scored(taken).structures()[1].near_misses == Misses{0, 0, 1, 0});
  // One that goes on is not counted yet, nor one that was left for less than the gap.
  CHECK(scored(ways({1.5e-3})).structures()[1].near_misses == Misses{});
  std::vector<RecordedTick> left = ways({1.5e-3, 3e-3, 5e-3});  // for 0.56 s
  CHECK(scored(left, {.event_gap = 0.6}).structures()[1].near_misses == Misses{0, 0, 1, 0});
  CHECK(scored(left, {.event_gap = 0.1}).structures()[1].near_misses == Misses{0, 0, 1, 1});
  // Another structure that is nearer meanwhile ends nothing, and has a near miss of its own.
  std::vector<RecordedTick> two = ways({1.5e-3, 5e-3});
  for (std::size_t i = 480; i < 520; ++i) near_structure(two[i], 3, 0.3e-3);
  const Scores of_two = scored(two);
  CHECK(of_two.structures()[1].near_misses == Misses{0, 0, 1, 0});
  CHECK(of_two.structures()[3].near_misses == Misses{1, 0, 0, 0});
  CHECK(of_two.around_structures().near_misses == Misses{1, 0, 0, 0});
  // An unknown distance is as good as far away.
  std::vector<RecordedTick> unknown = ways({1.5e-3});
  append(unknown, 1, [](double, RecordedTick&) {});
  CHECK(scored(unknown).around_structures().near_misses == Misses{0, 0, 1, 0});
  // A list without entries counts in the sum.
  CHECK(scored(five, {.structures = 0}).around_structures().near_misses == expected);
}

TEST_CASE("scores: time and number of forces over a limit, everywhere and near a structure") {
  // Two triangles of 0 to 4 N and back in 8 s: over 3 N for 2 s each. The second is 1 mm from a structure.
  std::vector<RecordedTick> ticks;
  append(ticks, 16, [](double t, RecordedTick& tick) {
    const double in_triangle = std::fmod(t - 0.5 * test::kTick, 8);
    tick.result.wrench.force = Vec3d(0.6, 0.8, 0) * (4 - std::abs(in_triangle - 4));
    near_structure(tick, 1, t < 8 ? 5e-3 : 1e-3);
  });
  const Scores scores = scored(ticks, {.force_limit = 3});
  CHECK(scores.totals().over_limit.count == 2);
  CHECK(scores.totals().over_limit.time == near(4, kClose));
  CHECK(scores.totals().peak_force == near(4, kClose));
  CHECK(scores.totals().mean_force() == near(2, kClose));
  CHECK(scores.around_structures().over_limit.count == 1);
  CHECK(scores.around_structures().over_limit.time == near(2, kClose));
  CHECK(scores.structures()[1].over_limit.time == near(2, kClose));
  CHECK(scored(ticks, {.force_limit = 3, .limit_distance = 6e-3}).around_structures().over_limit.count == 2);
  CHECK(scored(ticks).totals().over_limit.count == 0);
}

TEST_CASE("scores: idle share, rates, and the use of tools") {
  // 3 s of drilling, 2 s in the air, 5 s without spindle; after 4 s another tool, after 9 s one of a large number.
  std::vector<RecordedTick> ticks;
  append(ticks, 10, [](double t, RecordedTick& tick) {
    const double at = t - 0.5 * test::kTick;
    test::place(tick, 2e-3 * std::min(at, 3.0));
    tick.result.removed_mm3 = at < 3 ? 0.004 : 0;
    if (at > 3) lift(tick);
    tick.input.spindle_on = at < 5;
  });
  Scores scores;
  scores.tool_changed(1);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (i == 4000) scores.tool_changed(3);
    if (i == 9000) scores.tool_changed(1000);
    scores(ticks[i]);
  }
  const SessionTotals totals = scores.totals();
  CHECK(totals.time == near(10));
  CHECK(totals.ticks == 10000);
  CHECK(totals.idle_share() == near(0.7, kClose));
  CHECK(totals.spindle_time == near(5, kClose));
  CHECK(totals.removal_rate() == near(4, kClose));
  CHECK(totals.mean_speed() == near(2e-3, kClose));
  CHECK(scores.tools()[0].time == 0);
  CHECK(scores.tools()[1].time == near(4));
  CHECK(scores.tools()[1].spindle_time == near(4));
  CHECK(scores.tools()[1].removed_mm3 == near(12));
  CHECK(scores.tools()[3].time == near(5));
  CHECK(scores.tools()[3].spindle_time == near(1));
  CHECK(scores.tools()[3].removed_mm3 == 0);
  CHECK(scores.unlisted_tools().time == near(1));
  scores.tool_changed(-1);
  scores(ticks[0]);
  CHECK(scores.unlisted_tools().removed_mm3 == near(0.004));

  scores.reset();
  CHECK(test::bits_of(scores) == test::bits_of(Scores()));
  CHECK(Scores().totals().idle_share() == 0);
  CHECK(Scores().totals().removal_rate() == 0);
}

TEST_CASE("scores: ticks that are no numbers count in time alone, and the next good tick goes on") {
  std::vector<RecordedTick> good;
  append(good, 1, [](double t, RecordedTick& tick) {
    test::place(tick, 10e-3 * t);
    tick.result.removed_mm3 = 0.001;
    near_structure(tick, 0, 0.3e-3);
  });
  const std::vector<std::function<void(RecordedTick&)>> faults = {
      [](RecordedTick& t) { t.result.status = Status::kBadInput; },
      [](RecordedTick& t) { t.result.status = Status::kNonFinite; },
      [](RecordedTick& t) { t.input.X_WT.translation().y() = kNaN; },
      [](RecordedTick& t) { t.input.X_WT.translation().y() = 1e300; },
      [](RecordedTick& t) { t.input.X_WT.linear()(0, 1) = kInfinity; },
      [](RecordedTick& t) { t.result.wrench.force.z() = kNaN; },
      [](RecordedTick& t) { t.result.wrench.force.z() = 1e200; },
      [](RecordedTick& t) { t.result.removed_mm3 = kNaN; },
      [](RecordedTick& t) { t.result.removed_mm3 = -1; },
      [](RecordedTick& t) { t.result.structures.taken_mm3 = kInfinity; },
      [](RecordedTick& t) { t.result.structures.refused_mm3 = kNaN; },
      [](RecordedTick& t) { t.result.structures.push.force.x() = kNaN; }};
  for (std::size_t f = 0; f < faults.size(); ++f) {
    CAPTURE(f);
    std::vector<RecordedTick> ticks = good;
    faults[f](ticks[700]);
    const Scores scores = scored(ticks);
    const SessionTotals totals = scores.totals();
    CHECK(totals.unusable == 1);
    CHECK(totals.time == near(1));
    CHECK(totals.stroke_time == near(0.999));
    CHECK(totals.removed_mm3 == near(0.999));
    CHECK(totals.strokes == 2);
    CHECK(scores.around_structures().shells[0].time == near(0.999));
    CHECK(totals.peak_force == 1);
  }
  // Distances that are no numbers are unknown, and intervals are clamped as a scene's are.
  std::vector<RecordedTick> ticks = good;
  ticks[10].result.structures.distance = kNaN;
  ticks[11].result.structures.distance = -kInfinity;
  ticks[12].result.structures.nearest = -1;
  ticks[13].dt = kNaN;
  ticks[14].dt = -5;
  ticks[15].dt = kInfinity;
  const Scores scores = scored(ticks);
  CHECK(scores.totals().unusable == 0);
  CHECK(scores.totals().time == near(0.997 + 2 * kShortestDt + kLongestDt));
  CHECK(scores.around_structures().breaches.count == 0);
  CHECK(scores.around_structures().distance == 0.3e-3);
  CHECK(scores.around_structures().shells[0].time == near(scores.totals().time - 3e-3));
}

TEST_CASE("scores: options out of range are refused") {
  const auto refusal = [](const ScoreOptions& options) -> std::string {
    try {
      Scores{options};
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "none";
  };
  CHECK(refusal({}) == "none");
  for (const double bad : {0.0, -1.0, kNaN, kInfinity, 0.5})
    CHECK(refusal({.chord = bad}).find("chord") != std::string::npos);
  for (const double bad : {-1.0, kNaN, kInfinity}) {
    CHECK(refusal({.lift_off = bad}).find("lift_off") != std::string::npos);
    CHECK(refusal({.event_gap = bad}).find("event_gap") != std::string::npos);
    CHECK(refusal({.limit_distance = bad}).find("limit_distance") != std::string::npos);
  }
  for (const double bad : {-1.0, kNaN}) CHECK(refusal({.force_limit = bad}).find("force_limit") != std::string::npos);
  CHECK(refusal({.force = static_cast<ScoredForce>(7)}).find("force must") != std::string::npos);
  CHECK(refusal({.strokes = std::size_t{1} << 40}).find("strokes") != std::string::npos);
  CHECK(refusal({.structures = 256}).find("structures") != std::string::npos);
  CHECK(refusal({.tools = 256}).find("tools") != std::string::npos);
}

/// A hand that strokes over the floor of a FloorScene and lifts off now and then.
HandTarget stroking(double t) {
  const double z = std::fmod(t, 1.0) < 0.7 ? -2e-3 : 4e-3;
  return {make_pose<double>(Mat3d::Identity(), Vec3d(8e-3 * std::sin(9 * t), 0.1e-3 * std::cos(40 * t), z)), 1u};
}

TEST_CASE("scores: live, from the recorder and from the file they have the same bits") {
  SimulatedDevice device(SimulatedDeviceOptions{}, stroking);
  test::FloorScene scene;
  const ScoreOptions options{.force_limit = 0.3, .strokes = 20};
  Scores live(options);
  Recorder recorder(10000);
  ServoLoop(device, scene, Registration{}, ServoOptions{}, NoPacing{}).run_for(10s, [&](const TickRecord& tick) {
    live(tick);
    recorder(tick);
  });
  live.finish();
  REQUIRE(live.totals().ticks == 10000);
  REQUIRE(live.totals().strokes > 20);
  REQUIRE(live.totals().over_limit.count > 0);
  REQUIRE(live.totals().removed_mm3 > 0);
  const test::SessionFile file("trephine_scores.rec");
  save_recording(file.path, recorder.ticks());
  const std::vector<RecordedTick> loaded = load_recording(file.path);
  CHECK(test::bits_of(scored(loaded, options)) == test::bits_of(live));
  // The comparison sees a picosecond of one tick.
  std::vector<RecordedTick> other = loaded;
  other[5000].dt += 1e-12;
  CHECK(test::bits_of(scored(other, options)) != test::bits_of(live));
}

TEST_CASE("scores: a tick takes no memory, and little time") {
  std::vector<RecordedTick> ticks;
  append(ticks, 20, [](double t, RecordedTick& tick) {
    test::place(tick, 5e-3 * std::sin(20 * t), 5e-3 * std::cos(3 * t));
    near_structure(tick, 3, 3e-3 + 3e-3 * std::cos(5 * t));
    tick.result.removed_mm3 = 1e-3;
    tick.result.structures.taken_mm3 = 1e-4;
  });
  Scores scores({.force_limit = 0.5, .strokes = 8});
  std::vector<double> times(ticks.size());
  const auto calls = test::heap_calls([&] {
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      const auto start = std::chrono::steady_clock::now();
      scores(ticks[i]);
      if (i % 1000 == 0) scores.tool_changed(static_cast<int>(i / 1000));
      times[i] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
    scores.finish();
  });
  if (test::AllocationGuard::available()) CHECK(calls == 0);
  REQUIRE(scores.unlisted_strokes() > 10);
  std::sort(times.begin(), times.end());
  MESSAGE("a tick's scores, median and 99.9 % [ns]: ", 1e9 * times[times.size() / 2], " ",
          1e9 * times[times.size() * 999 / 1000]);
  static_assert(noexcept(scores(ticks[0]))&& noexcept(scores.tool_changed(1))&& noexcept(scores.finish()));
}

}  // namespace
