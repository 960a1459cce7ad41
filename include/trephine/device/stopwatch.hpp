// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/pacing.hpp>
#include <trephine/device/statistics.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Measures wall time and processor time of an interval of the haptic thread. Their difference is the time that the
/// operating system gave to others.
class Stopwatch {
 public:
  explicit Stopwatch(bool running) noexcept : running_(running) {
    if (!running_) return;
    cpu_ = thread_cpu_time();
    wall_ = ServoClock::now();
  }

  /// Adds both times since construction to the histograms; adds nothing unless constructed running. Without a platform
  /// clock for it, processor time is not added.
  void stop(TimeHistogram& wall, TimeHistogram& cpu) const noexcept {
    if (!running_) return;
    wall.add(std::chrono::duration<double>(ServoClock::now() - wall_).count());
    const double now = thread_cpu_time();
    if (cpu_ >= 0 && now >= 0) cpu.add(now - cpu_);
  }

 private:
  bool running_;
  double cpu_ = 0;
  ServoClock::time_point wall_{};
};

}  // namespace trephine
