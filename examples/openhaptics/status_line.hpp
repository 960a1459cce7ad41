// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/watcher.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace openhaptics {

/// One line that tells how the drilling goes: time, rate, force, removed bone and a note. The servo thread stores four
/// numbers; a thread of this object prints them, ten times a second over itself on a terminal, once a second elsewhere.
class StatusLine {
 public:
  /// `note`: called by the printing thread; what else there is to say, empty for nothing.
  explicit StatusLine(std::function<std::string()> note);

  /// From the servo thread; never waits.
  void publish(double force_N, double removed_mm3, bool spindle) noexcept {
    force_N_.store(force_N, std::memory_order_relaxed);
    removed_mm3_.store(removed_mm3, std::memory_order_relaxed);
    spindle_.store(spindle, std::memory_order_relaxed);
    ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

 private:
  using Clock = std::chrono::steady_clock;
  void look(bool done);

  std::function<std::string()> note_;
  bool terminal_ = drill::is_terminal();
  std::atomic<double> force_N_{0}, removed_mm3_{0};
  std::atomic<bool> spindle_{false};
  std::atomic<std::uint64_t> ticks_{0};
  // The printing thread's.
  Clock::time_point began_ = Clock::now(), last_ = began_;
  std::uint64_t ticks_before_ = 0;
  drill::Watcher watcher_;
};

}  // namespace openhaptics
