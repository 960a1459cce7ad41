// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/session/scores.hpp>

#include <bit>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <vector>

/// Sessions by a script, whose scores follow from formulas.
namespace trephine::test {

constexpr double kTick = 1e-3;  // [s]

/// Calls `make(t, tick)` for ticks at t = dt, 2 dt, ... up to `seconds` and appends them. A tick begins as one with the
/// spindle on, in contact, under 1 N, far from all structures.
inline void append(std::vector<RecordedTick>& ticks, double seconds,
                   const std::function<void(double t, RecordedTick&)>& make, double dt = kTick) {
  const int count = static_cast<int>(seconds / dt + 0.5);
  for (int i = 1; i <= count; ++i) {
    RecordedTick tick;
    tick.dt = dt;
    tick.input.spindle_on = true;
    tick.result.contact.count = 1;
    tick.result.wrench.force = Vec3d(0, 0, 1);
    make(i * dt, tick);
    ticks.push_back(tick);
  }
}

inline void place(RecordedTick& tick, double x, double y = 0, double z = 0) {
  tick.input.X_WT.translation() = Vec3d(x, y, z);
}
inline void lift(RecordedTick& tick) {
  tick.result.contact.count = 0;
  tick.result.wrench.force.setZero();
}
inline void near_structure(RecordedTick& tick, int structure, double distance) {
  tick.result.structures.nearest = structure;
  tick.result.structures.distance = distance;
}

inline Scores scored(const std::vector<RecordedTick>& ticks, const ScoreOptions& options = {}) {
  Scores scores(options);
  for (const RecordedTick& tick : ticks) scores(tick);
  scores.finish();
  return scores;
}

/// Every number of the scores, as bits.
inline std::vector<std::uint64_t> bits_of(const Scores& scores) {
  std::vector<std::uint64_t> bits;
  const auto put = [&bits](std::initializer_list<double> numbers) {
    for (const double& number : numbers) bits.push_back(std::bit_cast<std::uint64_t>(number));
  };
  const auto put_events = [&](const ScoredEvents& e) {
    bits.push_back(e.count);
    put({e.time, e.end});
  };
  const auto put_structure = [&](const StructureScores& s) {
    for (const Shell& shell : s.shells) put({shell.time, shell.removed_mm3});
    put({s.inside.time, s.inside.removed_mm3, s.distance, s.breached_mm3, s.breach_depth});
    put_events(s.breaches);
    put_events(s.over_limit);
    for (const std::uint64_t misses : s.near_misses) bits.push_back(misses);
  };
  const SessionTotals t = scores.totals();
  for (const std::uint64_t count : {t.ticks, t.unusable, t.strokes, scores.unlisted_strokes()}) bits.push_back(count);
  put({t.time, t.missing_time, t.spindle_time, t.removed_mm3, t.refused_mm3, t.peak_force, t.stroke_time,
       t.stroke_length, t.stroke_impulse, t.stroke_mm3});
  put_events(t.over_limit);
  for (const Stroke& s : scores.strokes())
    put({s.start, s.duration, s.length, s.peak_speed, s.turning, s.impulse, s.peak_force, s.removed_mm3, s.distance,
         static_cast<double>(s.nearest), static_cast<double>(s.tool), static_cast<double>(s.end)});
  put_structure(scores.around_structures());
  for (const StructureScores& s : scores.structures()) put_structure(s);
  for (const ToolUse& use : scores.tools()) put({use.time, use.spindle_time, use.removed_mm3});
  put({scores.unlisted_tools().time, scores.unlisted_tools().spindle_time, scores.unlisted_tools().removed_mm3});
  return bits;
}

}  // namespace trephine::test
