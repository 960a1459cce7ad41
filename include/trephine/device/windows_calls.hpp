// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

/// Windows' calls for waiting and for priority, declared as in windows.h, whose macros a header must not bring. Empty
/// on other platforms.
#if defined(_WIN32)

union _LARGE_INTEGER;
struct _SECURITY_ATTRIBUTES;
extern "C" {
__declspec(dllimport) void* __stdcall GetCurrentThread();
__declspec(dllimport) int __stdcall GetThreadPriority(void* thread);
__declspec(dllimport) int __stdcall SetThreadPriority(void* thread, int priority);
__declspec(dllimport) void* __stdcall CreateWaitableTimerExW(_SECURITY_ATTRIBUTES* security, const wchar_t* name,
                                                             unsigned long flags, unsigned long access);
__declspec(dllimport) int __stdcall SetWaitableTimer(void* timer, const _LARGE_INTEGER* due, long period,
                                                     void(__stdcall* done)(void*, unsigned long, unsigned long),
                                                     void* argument, int resume);
__declspec(dllimport) unsigned long __stdcall WaitForSingleObject(void* handle, unsigned long milliseconds);
__declspec(dllimport) int __stdcall CloseHandle(void* handle);
}

namespace trephine::inline TREPHINE_ALIGNED::detail {

inline constexpr int kTimeCritical = 15;             // THREAD_PRIORITY_TIME_CRITICAL
inline constexpr int kNoPriority = 0x7fffffff;       // THREAD_PRIORITY_ERROR_RETURN
inline constexpr unsigned long kHighResolution = 2;  // CREATE_WAITABLE_TIMER_HIGH_RESOLUTION, Windows 10 1803 and later
inline constexpr unsigned long kTimerAccess = 0x100002;  // SYNCHRONIZE | TIMER_MODIFY_STATE
inline constexpr unsigned long kForever = 0xffffffff;    // INFINITE

/// A timer for the waits of one thread, of half a millisecond's resolution where Windows has such; ordinary ones and
/// the standard library's sleep wait up to 15.6 ms too long.
class WaitableTimer {
 public:
  WaitableTimer() noexcept : handle_(CreateWaitableTimerExW(nullptr, nullptr, kHighResolution, kTimerAccess)) {}
  ~WaitableTimer() {
    if (handle_ != nullptr) CloseHandle(handle_);
  }
  WaitableTimer(const WaitableTimer&) = delete;
  WaitableTimer& operator=(const WaitableTimer&) = delete;

  /// Waits for a time in units of 100 ns; false where there is no such timer.
  [[nodiscard]] bool wait(long long time) const noexcept {
    const long long due = -time;  // negative: from now on
    return handle_ != nullptr &&
           SetWaitableTimer(handle_, reinterpret_cast<const _LARGE_INTEGER*>(&due), 0, nullptr, nullptr, 0) != 0 &&
           WaitForSingleObject(handle_, kForever) == 0;
  }

 private:
  void* handle_;
};

}  // namespace trephine::detail

#endif
