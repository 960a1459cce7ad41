// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/windows_calls.hpp>

#include <chrono>
#include <concepts>
#include <ratio>
#include <thread>

#if defined(__unix__) || defined(__APPLE__)
#include <cerrno>
#include <ctime>
#endif

/// Clocks, and policies by which a polled servo loop waits for its next tick. Only this header, windows_calls.hpp and
/// realtime.hpp depend on the platform. Elsewhere than on Linux and Windows they use the standard library, with
/// otherwise equal behaviour.
namespace trephine::inline TREPHINE_ALIGNED {

using ServoClock = std::chrono::steady_clock;

/// Returns the processor time of this thread [s]; negative if the platform does not provide it. On Linux a system call
/// of about 0.3 µs.
[[nodiscard]] inline double thread_cpu_time() noexcept {
#if defined(CLOCK_THREAD_CPUTIME_ID)
  timespec t{};
  if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t) != 0) return -1.0;
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
#else
  return -1.0;
#endif
}

/// Sleeps until an absolute time, so that errors do not accumulate; returns at once if that time has passed. Never ends
/// early, as the sleep of MinGW's standard library does.
inline void sleep_until(ServoClock::time_point when) noexcept {
#if defined(__linux__)
  // steady_clock is CLOCK_MONOTONIC here; the standard library's sleep is relative and drifts when interrupted.
  const auto since_epoch = std::chrono::duration_cast<std::chrono::nanoseconds>(when.time_since_epoch()).count();
  timespec t{};
  t.tv_sec = static_cast<std::time_t>(since_epoch / 1'000'000'000);
  t.tv_nsec = static_cast<long>(since_epoch % 1'000'000'000);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
#elif defined(_WIN32)
  thread_local const detail::WaitableTimer timer;
  using Unit = std::chrono::duration<long long, std::ratio<1, 10'000'000>>;
  for (auto now = ServoClock::now(); now < when; now = ServoClock::now())
    if (!timer.wait(std::chrono::ceil<Unit>(when - now).count())) std::this_thread::sleep_until(when);
#else
  while (ServoClock::now() < when) std::this_thread::sleep_until(when);
#endif
}

/// A policy that paces a polled loop. With `kRealTime` false, time is simulated: ticks follow each other at once and dt
/// is exactly the period.
template <class P>
concept Pacing = requires(P& pacing, ServoClock::time_point when) {
  { P::kRealTime } -> std::convertible_to<bool>;
  { pacing.wait_until(when) } noexcept;
};

/// Sleeps until each tick, for rates up to a few kHz. The processor is free between ticks. Wake-ups are late by the
/// system's latency: tens of microseconds, less with real-time priority.
struct SleepPacing {
  static constexpr bool kRealTime = true;
  void wait_until(ServoClock::time_point when) noexcept { sleep_until(when); }
};

/// Sleeps until `spin` before each tick, then polls the clock: for 10 to 40 kHz, or if lateness matters more than a
/// processor. With `spin` longer than the period it never sleeps and occupies a core. Do not use that at real-time
/// priority on a machine with a single core.
struct SleepSpinPacing {
  static constexpr bool kRealTime = true;
  std::chrono::nanoseconds spin = std::chrono::microseconds(100);  ///< longer than a usual late wake-up

  void wait_until(ServoClock::time_point when) noexcept {
    if (when - ServoClock::now() > spin) sleep_until(when - spin);
    while (ServoClock::now() < when) {
    }
  }
};

/// Runs as fast as possible, in simulated time; only for devices that the loop advances.
struct NoPacing {
  static constexpr bool kRealTime = false;
  void wait_until(ServoClock::time_point) noexcept {}
};

}  // namespace trephine
