// SPDX-License-Identifier: MIT
#pragma once

#include "hd_standin/hd_standin.hpp"
#include "openhaptics_device.hpp"

#include <atomic>
#include <chrono>
#include <map>
#include <thread>
#include <utility>
#include <vector>

/// What the tests of the adapter and the stand-in share.
namespace trephine::test {

/// A stand-in device with a motionless hand that is easy to reckon with: no friction, quantum or motion worth a name.
inline hd_standin::Model rigid(const char* name = "Default Device", int output_dof = 6) {
  hd_standin::Model model{.name = name, .output_dof = output_dof};
  model.mechanics.linear = {.inertia = 100, .damping = 0, .friction = 0, .quantum = 0, .limit = 0};
  model.mechanics.angular = {.inertia = 100, .damping = 0, .friction = 0, .quantum = 0, .limit = 0};
  return model;
}

/// Calls `f(i)` in n servo ticks of a self-paced device, between start and stop; false: it did not start or hung.
template <class Device, class F>
bool in_ticks(Device& device, int n, F&& f) {
  struct Call {
    F& f;
    int n;
    int i = 0;
    std::atomic<bool> done{false};
  } call{f, n};
  const ServoCallback tick = [](void* user) noexcept {
    auto& c = *static_cast<Call*>(user);
    c.f(c.i);
    const bool more = ++c.i < c.n;
    if (!more) c.done.store(true, std::memory_order_release);
    return more;
  };
  const bool started = device.start(tick, &call) == DeviceStatus::kOk;
  for (int ms = 0; started && ms < 5000 && !call.done.load(std::memory_order_acquire); ++ms)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  device.stop();
  return started && call.done.load();
}

/// Runs `f()` in the servo thread and waits for it.
template <class F>
void in_servo_thread(F&& f) {
  const auto once = [](void* user) -> HDCallbackCode {
    (*static_cast<std::remove_reference_t<F>*>(user))();
    return HD_CALLBACK_DONE;
  };
  hdScheduleSynchronous(once, &f, HD_DEFAULT_SCHEDULER_PRIORITY);
}

/// Pops everything, newest first.
inline std::vector<HDerror> popped() {
  std::vector<HDerror> codes;
  for (HDErrorInfo e = hdGetError(); HD_DEVICE_ERROR(e); e = hdGetError()) codes.push_back(e.errorCode);
  return codes;
}

}  // namespace trephine::test
