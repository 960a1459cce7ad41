// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace openhaptics {

/// One line that tells how the drilling goes: time, rate, force, removed bone and a note. The servo thread stores four
/// numbers; a thread of this object prints them, ten times a second over itself on a terminal, once a second elsewhere.
class StatusLine {
 public:
  /// `note`: called by the printing thread; what else there is to say, empty for nothing.
  explicit StatusLine(std::function<std::string()> note);
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// From the servo thread; never waits.
  void publish(double force_N, double removed_mm3, bool spindle) noexcept {
    force_N_.store(force_N, std::memory_order_relaxed);
    removed_mm3_.store(removed_mm3, std::memory_order_relaxed);
    spindle_.store(spindle, std::memory_order_relaxed);
    ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

 private:
  void watch();

  std::function<std::string()> note_;
  bool terminal_;
  std::atomic<double> force_N_{0}, removed_mm3_{0};
  std::atomic<bool> spindle_{false};
  std::atomic<std::uint64_t> ticks_{0};
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace openhaptics
