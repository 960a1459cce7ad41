// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <concepts>
#include <thread>

#if defined(__unix__) || defined(__APPLE__)
#include <cerrno>
#include <ctime>
#endif

/// Clocks and how a polled servo loop waits for its next tick. One of the two headers that know the platform (the other
/// is realtime.hpp): where POSIX clocks are missing, the standard library's stand in and behaviour is otherwise equal.
namespace trephine {

using ServoClock = std::chrono::steady_clock;

/// Processor time this thread has used [s]; negative where the platform does not tell. A system call on Linux, about
/// 0.3 µs.
[[nodiscard]] inline double thread_cpu_time() noexcept {
#if defined(CLOCK_THREAD_CPUTIME_ID)
  timespec t{};
  if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t) != 0) return -1.0;
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
#else
  return -1.0;
#endif
}

/// Sleeps until an absolute time, so that errors do not add up; returns at once when it has passed.
inline void sleep_until(ServoClock::time_point when) noexcept {
#if defined(__linux__)
  // steady_clock is CLOCK_MONOTONIC here; the standard library's sleep is relative and drifts when interrupted.
  const auto since_epoch = std::chrono::duration_cast<std::chrono::nanoseconds>(when.time_since_epoch()).count();
  timespec t{};
  t.tv_sec = static_cast<std::time_t>(since_epoch / 1'000'000'000);
  t.tv_nsec = static_cast<long>(since_epoch % 1'000'000'000);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
#else
  std::this_thread::sleep_until(when);
#endif
}

/// How a polled loop keeps its rate. `kRealTime` false: time does not pass by itself, ticks follow each other at once
/// and dt is exactly the period.
template <class P>
concept Pacing = requires(P& pacing, ServoClock::time_point when) {
  { P::kRealTime } -> std::convertible_to<bool>;
  { pacing.wait_until(when) }
  noexcept;
};

/// Sleeps to each tick: the processor is free between ticks, wake-ups are as late as the system makes them (tens of
/// microseconds; less with real-time priority). For rates up to a few kHz.
struct SleepPacing {
  static constexpr bool kRealTime = true;
  void wait_until(ServoClock::time_point when) noexcept { sleep_until(when); }
};

/// Sleeps to `spin` before each tick and then watches the clock: for 10 to 40 kHz, or where lateness matters more than
/// a processor. With `spin` longer than the period it never sleeps and occupies a core: not at real-time priority on a
/// machine that has only one.
struct SleepSpinPacing {
  static constexpr bool kRealTime = true;
  std::chrono::nanoseconds spin = std::chrono::microseconds(100);

  void wait_until(ServoClock::time_point when) noexcept {
    if (when - ServoClock::now() > spin) sleep_until(when - spin);
    while (ServoClock::now() < when) {
    }
  }
};

/// As fast as possible, in simulated time. Only for devices that are advanced by the loop.
struct NoPacing {
  static constexpr bool kRealTime = false;
  void wait_until(ServoClock::time_point) noexcept {}
};

}  // namespace trephine
