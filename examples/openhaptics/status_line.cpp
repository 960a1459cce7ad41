// SPDX-License-Identifier: MIT
#include "status_line.hpp"

#include <array>
#include <cstdio>
#include <utility>

namespace openhaptics {

StatusLine::StatusLine(std::function<std::string()> note)
    : note_(std::move(note)),
      watcher_(std::chrono::milliseconds(terminal_ ? 100 : 1000), [this](bool done) { look(done); }) {}

void StatusLine::look(bool done) {
  const auto now = Clock::now();
  const double passed = std::chrono::duration<double>(now - last_).count();
  if (passed >= 0.05) {  // else too short for a rate
    const std::uint64_t ticks = ticks_.load(std::memory_order_relaxed);
    const double rate = static_cast<double>(ticks - ticks_before_) / passed;
    std::array<char, 128> line{};
    std::snprintf(line.data(), line.size(), "%6.1f s  %5.0f Hz  %5.2f N  %8.2f mm3 removed  %-8s",
                  std::chrono::duration<double>(now - began_).count(), rate, force_N_.load(std::memory_order_relaxed),
                  removed_mm3_.load(std::memory_order_relaxed),
                  spindle_.load(std::memory_order_relaxed) ? "spindle" : "");
    const std::string note = note_ ? note_() : std::string();
    // A terminal's line is overwritten: clear what a longer one has left.
    std::printf(terminal_ ? "\r%s%s\x1b[K" : "%s%s\n", line.data(), note.c_str());
    std::fflush(stdout);
    last_ = now;
    ticks_before_ = ticks;
  }
  if (done && terminal_) std::printf("\n");
}

}  // namespace openhaptics
