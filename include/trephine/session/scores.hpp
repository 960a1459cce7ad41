// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/math.hpp>
#include <trephine/core/status.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/score_options.hpp>
#include <trephine/session/session_totals.hpp>
#include <trephine/session/stroke.hpp>
#include <trephine/stage/motion.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Scores a session of drilling while it runs, or from its recording, with the same bits.
/// \code
/// Scores scores{{.force_limit = 2}};
/// loop.run_for(60s, scores);              // live: an observer of the servo loop, as a Recorder is
/// visit_session("session.log", scores);   // or later
/// \endcode
/// Each tick stands for the interval dt before it, clamped as a scene does. A tick that reports `kBadInput` or
/// `kNonFinite`, or whose pose, force or volumes are unusable, counts in `time` and `unusable` alone, and ends
/// a stroke. A jump ends a stroke, too. Positions are in W, so the bone is taken to be at rest.
///
/// All storage is taken at construction. Strokes beyond `ScoreOptions::strokes` are in the totals and not in the list.
/// One thread at a time; ticks and changes of tool are noexcept and bounded, without memory, lock or clock.
class Scores {
 public:
  /// Throws std::invalid_argument if an option is out of range.
  explicit Scores(const ScoreOptions& options = {}) : options_((options.validate(), options)) {
    strokes_.reserve(options.strokes);
    structures_.resize(options.structures);
    approaches_.resize(options.structures);
    tools_.resize(options.tools);
    reset();
  }

  /// Adds a tick. Call it after each tick of the scene.
  void add(const TickInput& input, double dt, const TickResult& result) noexcept {
    const double interval = clamped_dt(dt);
    totals_.time += interval;
    ++totals_.ticks;
    const TickResult& r = result;
    const double force = options_.force == ScoredForce::kThrust
                             ? r.cutting.thrust
                             : Vec3d(r.wrench.force - r.structures.push.force).norm();
    if (!is_usable(input, r, force)) {
      ++totals_.unusable;
      end_stroke(StrokeEnd::kBreak);
      finder_.forget_position();
      return;
    }
    const bool jumps = r.status == Status::kJump;
    const bool knows_distance = r.structures.nearest >= 0 && is_finite(r.structures.distance);
    const detail::StrokeTick tick{
        .p_WT = input.X_WT.translation(),
        .end = totals_.time,
        .dt = interval,
        .force = force,
        .removed_mm3 = r.removed_mm3,
        .distance = knows_distance ? r.structures.distance : std::numeric_limits<double>::infinity(),
        .nearest = knows_distance ? r.structures.nearest : -1,
        .drills = input.spindle_on && r.contact.count > 0 && !jumps};
    if (jumps) {
      end_stroke(StrokeEnd::kBreak);
      finder_.forget_position();
    }
    finder_.add(tick, tool_, [this](const Stroke& s) { store(s); });
    add_totals(tick, input.spindle_on, r.structures.refused_mm3);
    add_structure(around_, approach_, tick, input.spindle_on, r.structures.taken_mm3);
    if (tick.nearest >= 0 && static_cast<std::size_t>(tick.nearest) < structures_.size()) {
      const auto s = static_cast<std::size_t>(tick.nearest);
      add_structure(structures_[s], approaches_[s], tick, input.spindle_on, r.structures.taken_mm3);
    }
    if (approach_.runs && totals_.time - tick.dt - near_until_ > options_.event_gap) end_approaches();
  }

  /// For `ServoLoop` and `visit_session`: adds what they observed.
  template <ObservedTick Tick>
  void operator()(const Tick& tick) noexcept {
    add(tick.input, tick.dt, tick.result);
  }

  /// From the next tick on the tool with this number is in the hand; 0 before. A change ends a stroke. The same thread.
  void tool_changed(int tool) noexcept {
    if (tool != tool_) end_stroke(StrokeEnd::kBreak);
    tool_ = tool;
  }

  /// Ticks are missing here (`SessionReport::dropped`): a stroke ends, and the path does not go on. Their time is in no
  /// score but `missing_time`. The same thread.
  void dropped(const DroppedRecords& records) noexcept {
    end_stroke(StrokeEnd::kBreak);
    finder_.forget_position();
    totals_.missing_time += records.time;
  }

  /// Ends the stroke that runs, after the last tick or before a pause, so that it is stored. The same thread.
  void finish() noexcept { end_stroke(StrokeEnd::kFinish); }

  /// Starts anew, with the same options and tool 0. The same thread.
  void reset() noexcept {
    totals_ = {};
    finder_ = {options_.chord, options_.lift_off};
    strokes_.clear();
    around_ = {};
    std::fill(structures_.begin(), structures_.end(), StructureScores{});
    approach_ = {};
    std::fill(approaches_.begin(), approaches_.end(), Approach{});
    std::fill(tools_.begin(), tools_.end(), ToolUse{});
    unlisted_tools_ = {};
    tool_ = 0;
  }

  /// Sums up to now, with the stroke that runs.
  [[nodiscard]] SessionTotals totals() const noexcept {
    SessionTotals all = totals_;
    if (finder_.runs()) add_stroke(all, finder_.so_far());
    return all;
  }
  /// The first strokes that have ended, in order; at most `ScoreOptions::strokes`.
  [[nodiscard]] std::span<const Stroke> strokes() const noexcept { return strokes_; }
  /// Ended strokes that found no room in the list.
  [[nodiscard]] std::uint64_t unlisted_strokes() const noexcept { return totals_.strokes - strokes_.size(); }
  /// Scores about whichever structure was nearest.
  [[nodiscard]] const StructureScores& around_structures() const noexcept { return around_; }
  /// Scores about each structure, by number.
  [[nodiscard]] std::span<const StructureScores> structures() const noexcept { return structures_; }
  /// Use of each tool, by number; and of all tools whose numbers are not in this list.
  [[nodiscard]] std::span<const ToolUse> tools() const noexcept { return tools_; }
  [[nodiscard]] const ToolUse& unlisted_tools() const noexcept { return unlisted_tools_; }
  [[nodiscard]] const ScoreOptions& options() const noexcept { return options_; }

 private:
  /// The tool's way to a structure and back.
  struct Approach {
    bool runs = false, breaches = false;
    double distance = std::numeric_limits<double>::infinity();  // smallest
  };

  [[nodiscard]] static bool is_usable(const TickInput& input, const TickResult& r, double force) noexcept {
    const auto is_volume = [](const double& v) { return is_finite(v) && v >= 0; };
    return r.status != Status::kBadInput && r.status != Status::kNonFinite && is_usable_pose(input.X_WT) &&
           is_finite(force) && is_volume(r.removed_mm3) && is_volume(r.structures.taken_mm3) &&
           is_volume(r.structures.refused_mm3);
  }

  void add_totals(const detail::StrokeTick& tick, bool spindle_on, double refused_mm3) noexcept {
    const double spindle_time = spindle_on ? tick.dt : 0;
    totals_.spindle_time += spindle_time;
    totals_.removed_mm3 += tick.removed_mm3;
    totals_.refused_mm3 += refused_mm3;
    totals_.peak_force = std::max(totals_.peak_force, tick.force);
    if (tick.force > options_.force_limit) totals_.over_limit.add(tick.end, tick.dt, options_.event_gap);
    const bool listed = tool_ >= 0 && static_cast<std::size_t>(tool_) < tools_.size();
    ToolUse& use = listed ? tools_[static_cast<std::size_t>(tool_)] : unlisted_tools_;
    use.time += tick.dt;
    use.spindle_time += spindle_time;
    use.removed_mm3 += tick.removed_mm3;
  }

  void add_structure(StructureScores& s, Approach& approach, const detail::StrokeTick& tick, bool spindle_on,
                     double taken_mm3) noexcept {
    s.add_distance(tick.distance, tick.dt, tick.removed_mm3);
    const bool breaches = taken_mm3 > 0 || (spindle_on && tick.distance < 0);
    if (breaches) s.breaches.add(tick.end, tick.dt, options_.event_gap);
    if (tick.distance < StructureScores::kShellEdges.back()) {
      approach.runs = true;
      approach.distance = std::min(approach.distance, tick.distance);
      near_until_ = tick.end;
    }
    approach.breaches = approach.breaches || breaches;
    s.breached_mm3 += taken_mm3;
    if (spindle_on) s.breach_depth = std::max(s.breach_depth, -tick.distance);
    if (tick.force > options_.force_limit && tick.distance < options_.limit_distance)
      s.over_limit.add(tick.end, tick.dt, options_.event_gap);
  }

  void end_approaches() noexcept {
    const auto end = [](StructureScores& s, Approach& approach) {
      if (approach.runs && !approach.breaches) ++s.near_misses[StructureScores::shell_of(approach.distance)];
      approach = {};
    };
    end(around_, approach_);
    for (std::size_t s = 0; s < structures_.size(); ++s) end(structures_[s], approaches_[s]);
  }

  static void add_stroke(SessionTotals& totals, const Stroke& s) noexcept {
    ++totals.strokes;
    totals.stroke_time += s.duration;
    totals.stroke_length += s.length;
    totals.stroke_impulse += s.impulse;
    totals.stroke_mm3 += s.removed_mm3;
  }
  void store(const Stroke& s) noexcept {
    add_stroke(totals_, s);
    if (strokes_.size() < options_.strokes) strokes_.push_back(s);
  }
  void end_stroke(StrokeEnd why) noexcept {
    finder_.end(why, [this](const Stroke& s) { store(s); });
  }

  ScoreOptions options_;
  SessionTotals totals_;  // without the stroke that runs
  detail::StrokeFinder finder_;
  std::vector<Stroke> strokes_;
  StructureScores around_;
  std::vector<StructureScores> structures_;
  Approach approach_;                 // to any structure
  std::vector<Approach> approaches_;  // to each
  double near_until_ = 0;             // when a structure was last as near as its last shell
  std::vector<ToolUse> tools_;
  ToolUse unlisted_tools_;
  int tool_ = 0;
};

}  // namespace trephine
