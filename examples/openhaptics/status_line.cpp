// SPDX-License-Identifier: MIT
#include "status_line.hpp"

#include <array>
#include <chrono>
#include <cstdio>

#if defined(_WIN32)
#include <io.h>
#else
#include <unistd.h>
#endif

namespace openhaptics {
namespace {

bool is_terminal() {
#if defined(_WIN32)
  return _isatty(1) != 0;
#else
  return isatty(1) != 0;
#endif
}

}  // namespace

StatusLine::StatusLine(std::function<std::string()> note)
    : note_(std::move(note)), terminal_(is_terminal()), thread_([this] { watch(); }) {}

StatusLine::~StatusLine() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void StatusLine::watch() {
  using Clock = std::chrono::steady_clock;
  const auto interval = std::chrono::milliseconds(terminal_ ? 100 : 1000);
  const auto began = Clock::now();
  auto last = began;
  std::uint64_t ticks_before = 0;
  std::unique_lock lock(mutex_);
  for (bool done = false; !done;) {
    done = wake_.wait_for(lock, interval, [this] { return done_; });
    const auto now = Clock::now();
    const double passed = std::chrono::duration<double>(now - last).count();
    if (passed < 0.05) break;  // too short for a rate
    const std::uint64_t ticks = ticks_.load(std::memory_order_relaxed);
    const double rate = static_cast<double>(ticks - ticks_before) / passed;
    std::array<char, 128> line{};
    std::snprintf(line.data(), line.size(), "%6.1f s  %5.0f Hz  %5.2f N  %8.2f mm3 removed  %-8s",
                  std::chrono::duration<double>(now - began).count(), rate, force_N_.load(std::memory_order_relaxed),
                  removed_mm3_.load(std::memory_order_relaxed),
                  spindle_.load(std::memory_order_relaxed) ? "spindle" : "");
    const std::string note = note_ ? note_() : std::string();
    // A terminal's line is overwritten: clear what a longer one has left.
    std::printf(terminal_ ? "\r%s%s\x1b[K" : "%s%s\n", line.data(), note.c_str());
    std::fflush(stdout);
    last = now;
    ticks_before = ticks;
  }
  if (terminal_) std::printf("\n");
}

}  // namespace openhaptics
