// SPDX-License-Identifier: MIT
#pragma once

#include "watcher.hpp"

#include <atomic>
#include <string>

namespace drill {

/// A line that says how far a run is. The haptic thread only stores three numbers; another thread prints them, several
/// times a second on a terminal and every quarter of the run elsewhere.
class Progress {
 public:
  Progress(std::string label, double seconds);

  void publish(double time, double force_N, double removed_mm3) noexcept {
    force_N_.store(force_N, std::memory_order_relaxed);
    removed_mm3_.store(removed_mm3, std::memory_order_relaxed);
    time_.store(time, std::memory_order_release);
  }

 private:
  void print(double time) const;
  void look(bool done);

  std::string label_;
  double seconds_;
  bool terminal_ = is_terminal();
  std::atomic<double> time_{0}, force_N_{0}, removed_mm3_{0};
  double next_ = 0.25 * seconds_;  // time of the next line where there is no terminal
  Watcher watcher_;
};

}  // namespace drill
