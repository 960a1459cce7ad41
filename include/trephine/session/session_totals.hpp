// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

/// What `Scores` adds up over a session. Times in s, lengths in m, volumes in mm³.
namespace trephine::inline TREPHINE_ALIGNED {

/// Something that happens now and then: how often and for how long.
struct ScoredEvents {
  std::uint64_t count = 0;
  double time = 0;                                        ///< in all [s]
  double end = -std::numeric_limits<double>::infinity();  ///< time of the session when it last happened [s]

  /// It happened during `dt` before the time `now`: as a new event if it did not for longer than `gap`.
  void add(double now, double dt, double gap) noexcept {
    if (now - dt - end > gap) ++count;
    time += dt;
    end = now;
  }
};

/// Time and bone removed while the tool was at certain distances from the nearest structure.
struct Shell {
  double time = 0;         ///< [s]
  double removed_mm3 = 0;  ///< bone of any kind [mm³]
};

/// Scores about one structure, over the ticks in which it was the nearest; or about all of them.
struct StructureScores {
  /// Outer distance of each shell [m]; the first begins at the structure's surface.
  static constexpr std::array<double, 4> kShellEdges{0.5e-3, 1e-3, 2e-3, 4e-3};

  std::array<Shell, 4> shells{};                              ///< distance below its edge and not below the last one's
  Shell inside{};                                             ///< distance < 0
  double distance = std::numeric_limits<double>::infinity();  ///< smallest [m]; negative inside
  /// A breach: bone of the structure was taken, or the tool was in it with the spindle on.
  ScoredEvents breaches{};
  double breached_mm3 = 0;    ///< bone of the structure that was taken (`StructureSummary::taken_mm3`)
  double breach_depth = 0;    ///< deepest that the tool was in it with the spindle on [m]
  ScoredEvents over_limit{};  ///< force over the limit, nearer than `ScoreOptions::limit_distance`
  /// Approaches without a breach, by their smallest distance in the shells; the first has those within, too, where the
  /// spindle stood still. An approach begins when this structure is the nearest and nearer than the last shell's edge,
  /// and ends once no structure was as near for longer than `ScoreOptions::event_gap`. One that goes on is not counted.
  std::array<std::uint64_t, 4> near_misses{};

  /// Adds an interval `dt` [s] at a distance [m], which is infinite if it is not known.
  void add_distance(double from_it, double dt, double removed) noexcept {
    distance = std::min(distance, from_it);
    const std::size_t number = shell_of(from_it);
    if (number == shells.size()) return;
    Shell& shell = from_it < 0 ? inside : shells[number];
    shell.time += dt;
    shell.removed_mm3 += removed;
  }
  /// Number of the shell with this distance, the first for one within; 4 beyond all.
  [[nodiscard]] static std::size_t shell_of(double from_it) noexcept {
    const auto* const edge =
        std::find_if(kShellEdges.begin(), kShellEdges.end(), [&](double e) { return from_it < e; });
    return static_cast<std::size_t>(edge - kShellEdges.begin());
  }
};

/// Use of one tool.
struct ToolUse {
  double time = 0;          ///< that it was in the hand [s]
  double spindle_time = 0;  ///< of this with the spindle on [s]
  double removed_mm3 = 0;
};

/// Sums over a session.
struct SessionTotals {
  double time = 0;             ///< [s]
  std::uint64_t ticks = 0;     ///< all
  std::uint64_t unusable = 0;  ///< of these counted in `time` alone
  double missing_time = 0;     ///< besides, of ticks that a log had dropped [s]
  double spindle_time = 0;     ///< with the spindle on [s]
  double removed_mm3 = 0;      ///< bone removed
  double refused_mm3 = 0;  ///< protected bone that cuts would have taken; a voxel counts in each tick that asks for it
  double peak_force = 0;   ///< in or out of strokes [N]
  ScoredEvents over_limit{};  ///< force over the limit, anywhere
  std::uint64_t strokes = 0;  ///< all, those that are not stored and the one that runs among them
  double stroke_time = 0;     ///< sum of their durations [s]
  double stroke_length = 0;   ///< sum of their lengths [m]
  double stroke_impulse = 0;  ///< sum of their impulses [N·s]
  double stroke_mm3 = 0;      ///< sum of the bone that they removed

  /// Share of the time outside of strokes, 0 to 1; 0 for an empty session.
  [[nodiscard]] double idle_share() const noexcept { return time > 0 ? std::max(0.0, 1 - stroke_time / time) : 0; }
  /// Bone removed per time in strokes [mm³/s]; 0 without strokes.
  [[nodiscard]] double removal_rate() const noexcept { return per_stroke_time(stroke_mm3); }
  /// Mean force over the time in strokes [N]; 0 without strokes.
  [[nodiscard]] double mean_force() const noexcept { return per_stroke_time(stroke_impulse); }
  /// Mean speed over the time in strokes [m/s]; 0 without strokes.
  [[nodiscard]] double mean_speed() const noexcept { return per_stroke_time(stroke_length); }

 private:
  [[nodiscard]] double per_stroke_time(double sum) const noexcept { return stroke_time > 0 ? sum / stroke_time : 0; }
};

}  // namespace trephine
