// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/statistics.hpp>

#include <cstdint>
#include <ostream>
#include <string>

namespace trephine::inline TREPHINE_ALIGNED {

/// Kind of end of a run of the servo loop.
enum class RunEnd : std::uint8_t {
  kFinished = 0,  ///< the duration is over, or the condition is true
  kStopped = 1,   ///< `stop()` was called
  kFault = 2,     ///< the device failed; `reason` gives the details
};

[[nodiscard]] constexpr const char* to_string(RunEnd end) noexcept {
  switch (end) {
    case RunEnd::kFinished:
      return "finished";
    case RunEnd::kStopped:
      return "stopped";
    case RunEnd::kFault:
      return "fault";
  }
  return "unknown";
}

/// Outcome and timing statistics of a run of the servo loop. Times in seconds.
struct RunReport {
  RunEnd end = RunEnd::kFinished;
  std::string reason;       ///< cause of the end, in words
  std::string priority;     ///< granted real-time priority, or the reason of a refusal
  bool zeroed = false;      ///< the device accepted the closing zero wrench
  std::uint64_t ticks = 0;  ///< ticks with a wrench of the scene
  double wall_time = 0;     ///< from the first tick to the closing zero
  double scene_time = 0;    ///< sum of the dt given to the scene
  TimeSummary tick_time;    ///< from before the read to after the write, real time even if scene time is simulated
  TimeSummary cpu_time;  ///< processor time of the same interval, with its own measurement (0.5 µs); no samples if the
                         ///< platform does not provide it
  TimeSummary lateness;  ///< delay of wake-ups; for a self-paced device, delay of its calls
  std::uint64_t missed_deadlines = 0;  ///< periods that started while an earlier tick was due or running
  std::uint64_t stalls = 0;            ///< intervals longer than the stall time
  std::uint64_t leaps = 0;             ///< readings farther from the last one than a hand moves
  std::uint64_t safety_trips = 0;      ///< ticks in which the device reported one
  std::uint64_t ramps = 0;             ///< restarts of the ramp from zero, the start included
  std::uint64_t limited = 0;           ///< wrenches shortened to the device's range
};

inline std::ostream& operator<<(std::ostream& out, const RunReport& r) {
  const auto line = [&out](const char* name, const TimeSummary& s) {
    if (s.count == 0) return;
    out << "  " << name << " [us]: p50 " << 1e6 * s.p50 << ", p99 " << 1e6 * s.p99 << ", p99.9 " << 1e6 * s.p99_9
        << ", max " << 1e6 * s.max << '\n';
  };
  out << to_string(r.end) << ": " << r.reason << (r.zeroed ? "" : " (the device did not take the closing zero)")
      << '\n';
  out << "  " << r.ticks << " ticks in " << r.wall_time << " s, " << r.missed_deadlines << " missed deadlines, "
      << r.stalls << " stalls, " << r.leaps << " leaps, " << r.safety_trips << " safety trips, " << r.ramps
      << " ramps, " << r.limited << " limited\n";
  line("tick time", r.tick_time);
  line("CPU time", r.cpu_time);
  line("lateness", r.lateness);
  return out << "  " << r.priority << '\n';
}

}  // namespace trephine
