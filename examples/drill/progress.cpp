// SPDX-License-Identifier: MIT
#include "progress.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

namespace drill {

Progress::Progress(std::string label, double seconds)
    : label_(std::move(label)),
      seconds_(seconds),
      watcher_(std::chrono::milliseconds(100), [this](bool done) { look(done); }) {}

void Progress::print(double time) const {
  constexpr int kWidth = 24;
  const double share = std::clamp(time / seconds_, 0.0, 1.0);
  const auto full = static_cast<int>(share * kWidth + 0.5);
  const std::string bar =
      std::string(static_cast<std::size_t>(full), '#') + std::string(static_cast<std::size_t>(kWidth - full), '.');
  std::printf("%s%-22s [%s] %3.0f %%  %5.2f s  %5.2f N  %7.1f mm3 removed%s", terminal_ ? "\r" : "", label_.c_str(),
              bar.c_str(), 100 * share, time, force_N_.load(std::memory_order_relaxed),
              removed_mm3_.load(std::memory_order_relaxed), terminal_ ? "" : "\n");
  std::fflush(stdout);
}

void Progress::look(bool done) {
  if (done) {
    print(seconds_);
    if (terminal_) std::printf("\n");
    std::fflush(stdout);
    return;
  }
  const double time = time_.load(std::memory_order_acquire);
  if (!terminal_ && time < next_) return;
  print(time);
  next_ += 0.25 * seconds_;
}

}  // namespace drill
