// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Why a stroke ended.
enum class StrokeEnd : std::uint8_t {
  kLiftOff = 0,   ///< contact or spindle was missing for longer than `ScoreOptions::lift_off`
  kReversal = 1,  ///< the path turned by more than a right angle within `ScoreOptions::chord`
  kBreak = 2,     ///< a jump, a tick that is missing or could not be used, or another tool
  kFinish = 3,    ///< the session ended, or the stroke still runs
};

/// A stroke: spindle on and in contact, from one lift-off or reversal to the next.
struct Stroke {
  double start = 0;        ///< time of the session [s]
  double duration = 0;     ///< [s]
  double length = 0;       ///< of the path of T's origin in W, in chords [m]
  double peak_speed = 0;   ///< highest mean speed over a whole chord [m/s]; 0 if the stroke is shorter
  double turning = 0;      ///< sum of the angles between whole chords that follow each other [rad]
  double impulse = 0;      ///< integral of the force over time [N·s]
  double peak_force = 0;   ///< [N]
  double removed_mm3 = 0;  ///< bone removed [mm³]
  double distance = std::numeric_limits<double>::infinity();  ///< smallest of the tool from a structure [m]
  int nearest = -1;                                           ///< number of that structure; -1: none
  int tool = 0;                                               ///< that was in use
  StrokeEnd end = StrokeEnd::kFinish;

  /// Mean force over time [N].
  [[nodiscard]] double mean_force() const noexcept { return duration > 0 ? impulse / duration : 0; }
  /// Length over duration [m/s].
  [[nodiscard]] double mean_speed() const noexcept { return duration > 0 ? length / duration : 0; }
  /// Mean curvature of the path, which is the turning over the length [1/m]: 1/R on an arc of radius R that is long
  /// beside a chord, 0 on a line.
  [[nodiscard]] double mean_curvature() const noexcept { return length > 0 ? turning / length : 0; }
};

namespace detail {

/// What a stroke takes from a tick, which stands for the interval `dt` before it.
struct StrokeTick {
  Vec3d p_WT = Vec3d::Zero();
  double end = 0, dt = 0;  // time of the session at the end of the interval; its length [s]
  double force = 0, removed_mm3 = 0, distance = 0;
  int nearest = -1;
  bool drills = false;  // spindle on and in contact
};

/// Finds strokes in a path that arrives tick by tick. Dividers of a fixed opening walk along it, so tremor that is
/// smaller adds no length and reverses nothing. What came since the farthest point in the direction of the last chord
/// waits in `back_`: it belongs to the next stroke if the next chord turns back, to this one otherwise. Ticks without
/// contact wait in `gap_`. Bounded work, no memory.
class StrokeFinder {
 public:
  StrokeFinder() = default;
  StrokeFinder(double chord, double lift_off) : chord_(chord), lift_off_(lift_off) {}

  /// Calls `ended(const Stroke&)` if this tick ends a stroke.
  template <class Ended>
  void add(const StrokeTick& tick, int tool, Ended&& ended) noexcept {
    if (tick.drills) {
      if (!runs_) begin(tick, tool);
      back_.add(gap_);
      gap_ = {};
      back_.add(tick);
      follow(tick.p_WT, tick.end, ended);
      last_ = tick.p_WT;
    } else if (runs_) {
      gap_.add(tick);
      if (gap_.duration > lift_off_) end(StrokeEnd::kLiftOff, ended);
    }
    p_WT_ = tick.p_WT;
    has_position_ = true;
  }

  /// Ends the stroke that runs, at its last contact.
  template <class Ended>
  void end(StrokeEnd why, Ended&& ended) noexcept {
    if (!runs_) return;
    ended(so_far(why));
    runs_ = false;
    gap_ = {};
  }
  /// Forgets where the tool was: the path does not go on from there.
  void forget_position() noexcept { has_position_ = false; }

  [[nodiscard]] bool runs() const noexcept { return runs_; }
  /// The stroke that runs, as if it ended here.
  [[nodiscard]] Stroke so_far(StrokeEnd why = StrokeEnd::kFinish) const noexcept {
    Part all = part_;
    all.add(back_);
    return stroke(all, last_, why);
  }

 private:
  /// What adds up over ticks.
  struct Part {
    double duration = 0, impulse = 0, peak_force = 0, removed_mm3 = 0;
    double distance = std::numeric_limits<double>::infinity();
    int nearest = -1;

    void add(const StrokeTick& t) noexcept {
      add(Part{t.dt, t.force * t.dt, t.force, t.removed_mm3, t.distance, t.nearest});
    }
    void add(const Part& o) noexcept {
      duration += o.duration;
      impulse += o.impulse;
      peak_force = std::max(peak_force, o.peak_force);
      removed_mm3 += o.removed_mm3;
      if (o.distance < distance) {
        distance = o.distance;
        nearest = o.nearest;
      }
    }
  };

  void begin(const StrokeTick& tick, int tool) noexcept {
    runs_ = true;
    tool_ = tool;
    start_ = tick.end - tick.dt;
    part_ = back_ = {};
    if (has_position_)
      start_path(p_WT_, start_);
    else
      start_path(tick.p_WT, tick.end);
  }
  void start_path(const Vec3d& from, double time) noexcept {
    corner_ = turn_ = from;
    corner_time_ = turn_time_ = time;
    length_ = reach_ = peak_speed_ = turning_ = 0;
    has_direction_ = false;
  }

  template <class Ended>
  void follow(const Vec3d& p, double time, Ended& ended) noexcept {
    const double progress = has_direction_ ? direction_.dot(p - corner_) : 0;
    if (progress >= reach_) {
      reach_ = progress;
      turn_ = p;
      turn_time_ = time;
      keep_back();
    }
    if ((p - corner_).norm() < chord_) return;
    if (progress < 0) {
      const Vec3d turn = turn_;
      ended(stroke(part_, turn, StrokeEnd::kReversal));
      start_ += part_.duration;
      part_ = {};
      start_path(turn, turn_time_);
      if ((p - corner_).norm() < chord_) return keep_back();
    }
    const Vec3d leg = p - corner_;
    const double length = leg.norm();
    length_ += length;
    peak_speed_ = std::max(peak_speed_, length / (time - corner_time_));
    const Vec3d direction = leg / length;
    if (has_direction_) turning_ += std::atan2(direction_.cross(direction).norm(), direction_.dot(direction));
    direction_ = direction;
    has_direction_ = true;
    corner_ = turn_ = p;
    corner_time_ = turn_time_ = time;
    reach_ = 0;
    keep_back();
  }
  void keep_back() noexcept {
    part_.add(back_);
    back_ = {};
  }

  [[nodiscard]] Stroke stroke(const Part& part, const Vec3d& to, StrokeEnd why) const noexcept {
    return {start_,
            part.duration,
            length_ + (to - corner_).norm(),
            peak_speed_,
            turning_,
            part.impulse,
            part.peak_force,
            part.removed_mm3,
            part.distance,
            part.nearest,
            tool_,
            why};
  }

  double chord_ = 0, lift_off_ = 0;
  bool runs_ = false, has_position_ = false, has_direction_ = false;
  int tool_ = 0;
  double start_ = 0;
  double length_ = 0, peak_speed_ = 0, turning_ = 0;  // of the chords up to corner_
  double corner_time_ = 0, turn_time_ = 0;            // when the path was at corner_ and turn_
  double reach_ = 0;                                  // farthest beyond corner_ along direction_
  Vec3d corner_ = Vec3d::Zero();                      // where the last chord ended
  Vec3d direction_ = Vec3d::Zero();                   // of the last chord
  Vec3d turn_ = Vec3d::Zero();                        // where reach_ was reached
  Vec3d last_ = Vec3d::Zero();                        // position at the last contact
  Vec3d p_WT_ = Vec3d::Zero();                        // position at the last tick
  Part part_, back_, gap_;
};

}  // namespace detail

}  // namespace trephine
