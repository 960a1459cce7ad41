// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/device/windows_calls.hpp>

#include <string>

#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#endif

namespace trephine::inline TREPHINE_ALIGNED {

/// Real-time settings that the loop requests from the operating system for its thread.
struct RealtimeOptions {
  /// SCHED_FIFO priority, 1 to 99; 0: none. On Windows any but 0 is the time-critical one.
  int priority = 80;
  /// Locks all present and future memory of the process in RAM, also after the loop. Under a small limit (ulimit -l)
  /// later allocations of the process can fail, so use it only in programs designed for it.
  bool lock_memory = false;
};

/// Requests real-time scheduling on construction and restores the thread's settings on destruction. `text` describes
/// the granted settings, or the reason of a refusal. A refusal does not throw: a loop without priority is late at
/// times, not wrong. On platforms other than Linux and Windows it requests nothing. Construct and destroy it in the
/// servo thread, outside the loop, because it allocates.
class RealtimeScope {
 public:
  /// Throws std::invalid_argument if the priority is outside 0..99.
  explicit RealtimeScope(const RealtimeOptions& options) {
    if (options.priority < 0 || options.priority > 99)
      refuse("RealtimeScope", "priority must be in 0..99", options.priority);
    request(options);
  }
  ~RealtimeScope() { restore(); }
  RealtimeScope(const RealtimeScope&) = delete;
  RealtimeScope& operator=(const RealtimeScope&) = delete;

  /// Returns true if this object gave the thread the priority.
  [[nodiscard]] bool granted() const noexcept { return granted_; }
  [[nodiscard]] bool memory_locked() const noexcept { return memory_locked_; }
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
#if defined(__linux__)
  void request(const RealtimeOptions& options) {
    timer_slack_ = prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0);
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);  // 1 ns instead of 50 µs late sleeps; needs no right
    if (options.priority == 0) {
      text_ = "no real-time priority requested";
    } else if (pthread_getschedparam(pthread_self(), &policy_before_, &param_before_) != 0) {
      text_ = "no real-time priority: the present scheduling is unknown";
    } else {
      sched_param param{};
      param.sched_priority = options.priority;
      const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
      granted_ = error == 0;
      text_ = granted_ ? "real-time priority " + std::to_string(options.priority) + " (SCHED_FIFO)"
                       : "no real-time priority: " + reason(error, "an rtprio limit (ulimit -r) or CAP_SYS_NICE");
    }
    if (!options.lock_memory) return;
    memory_locked_ = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    text_ += memory_locked_ ? "; memory locked"
                            : "; memory not locked: " + reason(errno, "a memlock limit (ulimit -l) or CAP_IPC_LOCK");
  }

  void restore() noexcept {
    if (timer_slack_ > 0) prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(timer_slack_), 0UL, 0UL, 0UL);
    if (granted_) pthread_setschedparam(pthread_self(), policy_before_, &param_before_);
  }

  static std::string reason(int error, const char* needs) {
    return error == EPERM || error == ENOMEM ? std::string("not permitted, it needs ") + needs
                                             : "error " + std::to_string(error);
  }

  int timer_slack_ = 0;
  int policy_before_ = 0;
  sched_param param_before_{};
#elif defined(_WIN32)
  void request(const RealtimeOptions& options) {
    void* const thread = GetCurrentThread();
    priority_before_ = GetThreadPriority(thread);
    if (options.priority == 0) {
      text_ = "no real-time priority requested";
    } else {
      granted_ = priority_before_ != detail::kNoPriority && SetThreadPriority(thread, detail::kTimeCritical) != 0;
      text_ = granted_ ? "time-critical priority" : "no time-critical priority: Windows refused it";
    }
    if (options.lock_memory) text_ += "; memory not locked: not requested on this platform";
  }
  void restore() noexcept {
    if (granted_) SetThreadPriority(GetCurrentThread(), priority_before_);
  }

  int priority_before_ = 0;
#else
  void request(const RealtimeOptions&) { text_ = "no real-time priority: not requested on this platform"; }
  void restore() noexcept {}
#endif

  bool granted_ = false;
  bool memory_locked_ = false;
  std::string text_;
};

}  // namespace trephine
