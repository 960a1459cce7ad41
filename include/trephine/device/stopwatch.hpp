// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/pacing.hpp>
#include <trephine/device/statistics.hpp>

namespace trephine {

/// Times a stretch of the haptic thread by the wall and by the processor. The difference is what the system took away.
class Stopwatch {
 public:
  explicit Stopwatch(bool running) noexcept : running_(running) {
    if (!running_) return;
    cpu_ = thread_cpu_time();
    wall_ = ServoClock::now();
  }

  /// Adds both times since construction; nothing if it never ran, no processor time where the platform has none.
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
