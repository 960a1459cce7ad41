// SPDX-License-Identifier: MIT
// Strokes of scripted paths, whose number and measures are known.
#include "script.hpp"

#include <doctest/doctest.h>

#include "support/near.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace trephine;
using test::append;
using test::lift;
using test::near;
using test::place;
using test::scored;
using test::within;

/// [share] of a closed form: ticks and chords are small beside strokes.
constexpr double kClose = 0.01;

/// From 0 to `width` and back, again and again, at `speed`.
double to_and_fro(double t, double width, double speed) {
  const double way = std::fmod(speed * t, 2 * width);
  return way <= width ? way : 2 * width - way;
}

TEST_CASE("strokes: to and fro are as many strokes as ways, each of its own length") {
  std::vector<RecordedTick> ticks;
  append(ticks, 2.5, [](double t, RecordedTick& tick) {
    place(tick, to_and_fro(t, 10e-3, 20e-3));
    tick.result.removed_mm3 = 0.002;
  });
  const Scores scores = scored(ticks);
  REQUIRE(scores.strokes().size() == 5);
  for (std::size_t i = 0; i < 5; ++i) {
    CAPTURE(i);
    const Stroke& s = scores.strokes()[i];
    CHECK(s.start == within(0.5 * static_cast<double>(i), 2e-3));
    CHECK(s.length == near(10e-3, kClose));
    CHECK(s.duration == near(0.5, kClose));
    CHECK(s.mean_speed() == near(20e-3, kClose));
    CHECK(s.mean_force() == near(1, kClose));
    CHECK(s.removed_mm3 == near(1, kClose));
    CHECK(s.end == (i < 4 ? StrokeEnd::kReversal : StrokeEnd::kFinish));
  }
  const SessionTotals totals = scores.totals();
  CHECK(totals.strokes == 5);
  CHECK(totals.stroke_length == near(50e-3, kClose));
  CHECK(totals.stroke_time == near(2.5));
  CHECK(totals.stroke_mm3 == near(5));
}

TEST_CASE("strokes: a lift-off ends one where contact ended, a flicker of contact does not") {
  // Three ways of 8 mm in 0.4 s with 0.2 s in the air between; within each, 30 ms without contact at 0.1 s.
  std::vector<RecordedTick> ticks;
  append(ticks, 1.8, [](double t, RecordedTick& tick) {
    const double in_way = std::fmod(t - 0.5 * test::kTick, 0.6);
    place(tick, 20e-3 * (t < 0.4 ? t : t < 1.0 ? std::max(0.6, t) - 0.2 : std::max(1.2, t) - 0.4));
    if (in_way > 0.4 || (in_way > 0.1 && in_way < 0.13)) lift(tick);
  });
  const Scores scores = scored(ticks);
  REQUIRE(scores.strokes().size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(i);
    const Stroke& s = scores.strokes()[i];
    CHECK(s.start == within(0.6 * static_cast<double>(i), 2e-3));
    CHECK(s.duration == near(0.4, kClose));
    CHECK(s.length == near(8e-3, kClose));
    CHECK(s.mean_force() == near(0.37 / 0.4, kClose));
    CHECK(s.end == StrokeEnd::kLiftOff);
  }
  // The same with the spindle instead of contact.
  for (RecordedTick& tick : ticks)
    if (tick.result.contact.count == 0) {
      tick.result.contact.count = 1;
      tick.input.spindle_on = false;
    }
  CHECK(scored(ticks).strokes().size() == 3);
  // And every flicker splits where none is allowed.
  CHECK(scored(ticks, {.lift_off = 0}).strokes().size() == 6);
}

TEST_CASE("strokes: circles are one stroke, as long as their arcs") {
  constexpr double kRadius = 4e-3;
  std::vector<RecordedTick> ticks;
  append(ticks, 3, [](double t, RecordedTick& tick) {
    const double angle = 2 * std::numbers::pi * t;
    place(tick, kRadius * std::cos(angle), kRadius * std::sin(angle), 1e-3 * t);
  });
  const Scores scores = scored(ticks);
  REQUIRE(scores.strokes().size() == 1);
  const double turn = std::hypot(2 * std::numbers::pi * kRadius, 1e-3);
  CHECK(scores.strokes()[0].length == near(3 * turn, kClose));
}

TEST_CASE("strokes: mean curvature is an arc's, and none of a line's; the peak of a speed is its own") {
  const auto stroke_of = [](double seconds, const std::function<void(double, RecordedTick&)>& make) {
    std::vector<RecordedTick> ticks;
    append(ticks, seconds, make);
    const Scores scores = scored(ticks);
    REQUIRE(scores.strokes().size() == 1);
    return scores.strokes()[0];
  };
  // A helix of 4 mm radius and 3 mm a turn, at 8 mm/s along its arc: its curvature is r / (r² + (pitch / 2π)²).
  constexpr double kRadius = 4e-3, kRise = 3e-3 / (2 * std::numbers::pi);
  const double arc = std::hypot(kRadius, kRise);
  const Stroke helix = stroke_of(20, [&](double t, RecordedTick& tick) {
    const double angle = 8e-3 * t / arc;
    place(tick, kRadius * std::cos(angle), kRadius * std::sin(angle), kRise * angle);
  });
  CHECK(helix.mean_curvature() == near(kRadius / (arc * arc), kClose));
  CHECK(helix.peak_speed == near(8e-3, kClose));
  // Half a circle turns by π less half a chord's angle at either end.
  const Stroke half = stroke_of(1, [&](double t, RecordedTick& tick) {
    place(tick, 8e-3 * std::cos(std::numbers::pi * t), 8e-3 * std::sin(std::numbers::pi * t));
  });
  CHECK(half.turning == within(std::numbers::pi, 2.5e-3 / 8e-3));
  CHECK(half.turning < std::numbers::pi);
  // A line at 10 ± 4 mm/s, and its peak; whatever trembles within a chord has no part in it.
  const Stroke line = stroke_of(2, [](double t, RecordedTick& tick) {
    const double way = 10e-3 * t - 4e-3 / std::numbers::pi * std::cos(std::numbers::pi * t);
    place(tick, 0.6 * way, 0.8 * way);
  });
  CHECK(line.mean_curvature() == within(0, 1e-6));
  CHECK(line.peak_speed == near(14e-3, 0.02));
  CHECK(line.mean_speed() == near(10e-3, kClose));
  const Stroke still = stroke_of(1, [](double, RecordedTick& tick) { place(tick, 1e-3); });
  CHECK(still.peak_speed == 0);
  CHECK(still.mean_curvature() == 0);
  // A way back begins anew where the way there ended, with its own peak.
  std::vector<RecordedTick> ticks;
  append(ticks, 3, [](double t, RecordedTick& tick) { place(tick, t < 1 ? 20e-3 * t : 20e-3 - 10e-3 * (t - 1)); });
  const Scores both = scored(ticks);
  REQUIRE(both.strokes().size() == 2);
  CHECK(both.strokes()[0].peak_speed == near(20e-3, kClose));
  CHECK(both.strokes()[1].peak_speed == near(10e-3, kClose));
  CHECK(both.strokes()[1].turning == within(0, 1e-6));
}

TEST_CASE("strokes: a hand that trembles at rest makes one stroke without length") {
  std::vector<RecordedTick> ticks;
  append(ticks, 10,
         [](double t, RecordedTick& tick) { place(tick, 0.36e-3 * std::sin(2 * std::numbers::pi * 10 * t)); });
  const Scores scores = scored(ticks);
  REQUIRE(scores.strokes().size() == 1);
  CHECK(scores.strokes()[0].length <= 0.72e-3);
  CHECK(scores.strokes()[0].duration == near(10));
  // Tremor on a way forward adds nothing to it, though its own path is half as long again.
  ticks.clear();
  append(ticks, 2, [](double t, RecordedTick& tick) {
    place(tick, 10e-3 * t, 0.1e-3 * std::sin(2 * std::numbers::pi * 10 * t));
  });
  CHECK(scored(ticks).strokes().size() == 1);
  CHECK(scored(ticks).totals().stroke_length == near(20e-3, 0.02));
}

TEST_CASE("strokes: mean and peak of a force, and the structure that came nearest") {
  // F = 2 + sin: over whole periods the mean is 2, the peak 3. The push of a guard is no force of the bone.
  std::vector<RecordedTick> ticks;
  append(ticks, 4, [](double t, RecordedTick& tick) {
    place(tick, 5e-3 * t);
    tick.result.structures.push.force = Vec3d(0, 5, 0);
    tick.result.wrench.force = Vec3d(0, 5, 2 + std::sin(2 * std::numbers::pi * t));
    tick.result.cutting.thrust = 30;
    test::near_structure(tick, t < 2 ? 3 : 5, 1e-3 * (1 + std::abs(t - 2.5)));
  });
  const Stroke s = scored(ticks).strokes()[0];
  CHECK(s.mean_force() == near(2, kClose));
  CHECK(s.peak_force == near(3, kClose));
  CHECK(s.nearest == 5);
  CHECK(s.distance == near(1e-3, kClose));
  const Stroke of_thrust = scored(ticks, {.force = ScoredForce::kThrust}).strokes()[0];
  CHECK(of_thrust.mean_force() == near(30));
  CHECK(of_thrust.peak_force == near(30));
}

TEST_CASE("strokes: jumps, unusable ticks and changes of tool end one") {
  const auto strokes_with = [](const std::function<void(RecordedTick&)>& change) {
    std::vector<RecordedTick> ticks;
    append(ticks, 1, [&](double t, RecordedTick& tick) {
      place(tick, t < 0.5 ? 10e-3 * t : 0.2 + 10e-3 * t);
      if (std::abs(t - 0.5) < 0.5 * test::kTick) change(tick);
    });
    return scored(ticks);
  };
  const std::vector<std::function<void(RecordedTick&)>> breaks = {
      [](RecordedTick& t) { t.result.status = Status::kJump; },
      [](RecordedTick& t) { t.result.status = Status::kBadInput; },
      [](RecordedTick& t) { t.result.status = Status::kNonFinite; },
      [](RecordedTick& t) { t.result.wrench.force.x() = std::numeric_limits<double>::quiet_NaN(); }};
  for (const auto& change : breaks) {
    const Scores scores = strokes_with(change);
    REQUIRE(scores.strokes().size() == 2);
    CHECK(scores.strokes()[0].end == StrokeEnd::kBreak);
    CHECK(scores.strokes()[0].length == near(5e-3, kClose));
    CHECK(scores.strokes()[1].length == near(5e-3, kClose));  // the way in between is nobody's
    CHECK(scores.totals().stroke_time == near(0.999));        // and so is the tick
  }

  std::vector<RecordedTick> ticks;
  append(ticks, 1, [](double t, RecordedTick& tick) { place(tick, 10e-3 * t); });
  Scores scores;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (i == 250) scores.tool_changed(0);  // which is no change
    if (i == 500) scores.tool_changed(2);
    scores(ticks[i]);
  }
  CHECK(scores.totals().strokes == 2);  // the one that runs is counted
  REQUIRE(scores.strokes().size() == 1);
  scores.finish();
  scores.finish();
  REQUIRE(scores.strokes().size() == 2);
  CHECK(scores.totals().strokes == 2);
  CHECK(scores.strokes()[0].tool == 0);
  CHECK(scores.strokes()[0].length == near(5e-3, kClose));
  CHECK(scores.strokes()[1].tool == 2);
}

TEST_CASE("strokes: ticks that a log dropped end one, and their way is nobody's") {
  std::vector<RecordedTick> ticks;
  append(ticks, 1, [](double t, RecordedTick& tick) { place(tick, 10e-3 * t); });
  Scores scores;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (i == 400) scores.dropped({.count = 200, .time = 0.2});
    if (i < 400 || i >= 600) scores(ticks[i]);
  }
  scores.finish();
  REQUIRE(scores.strokes().size() == 2);
  CHECK(scores.strokes()[0].end == StrokeEnd::kBreak);
  CHECK(scores.totals().stroke_length == near(8e-3, kClose));
  CHECK(scores.totals().time == near(0.8));
  CHECK(scores.totals().missing_time == near(0.2));
}

TEST_CASE("strokes: a full list keeps the first ones, and the totals keep all") {
  std::vector<RecordedTick> ticks;
  append(ticks, 5, [](double t, RecordedTick& tick) { place(tick, to_and_fro(t, 5e-3, 10e-3)); });
  const Scores all = scored(ticks), few = scored(ticks, {.strokes = 3}), none = scored(ticks, {.strokes = 0});
  REQUIRE(all.strokes().size() == 10);
  REQUIRE(few.strokes().size() == 3);
  CHECK(few.strokes()[2].start == all.strokes()[2].start);
  CHECK(all.unlisted_strokes() == 0);
  CHECK(few.unlisted_strokes() == 7);
  CHECK(none.unlisted_strokes() == 10);
  CHECK(few.totals().strokes == 10);
  CHECK(few.totals().stroke_length == all.totals().stroke_length);
  CHECK(none.totals().stroke_time == all.totals().stroke_time);
}

}  // namespace
