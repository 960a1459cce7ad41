// SPDX-License-Identifier: MIT
#pragma once

#include "openhaptics_errors.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

namespace openhaptics {

/// What the devices of a process share: one scheduler with one servo thread, and one stack of errors.
///
/// The scheduler runs while anybody uses it: the first user starts it, the last one stops it. Opening and closing
/// change the driver's notion of the current device, which the servo thread relies on; so devices are opened before the
/// scheduler runs, and those closed while it runs are closed when it stops.
///
/// Errors are popped by whichever device looks first, and delivered to the slot of the device that they name; an error
/// that names none of ours goes to the one that popped it. Errors are delivered without lock or allocation, by the
/// servo thread; everything else is for controlling threads and may wait for another.
class SharedScheduler {
 public:
  static constexpr std::size_t kMaxDevices = 8;

  /// Errors of one device that it has not looked at yet: the last trip and the last fault.
  struct Slot {
    std::atomic<HHD> device{HD_INVALID_HANDLE};
    std::atomic<HDerror> trip{HD_SUCCESS};
    std::atomic<HDerror> fault{HD_SUCCESS};
  };

  static SharedScheduler& instance() {
    static SharedScheduler shared;
    return shared;
  }

  /// Opens a device (empty name: the driver's default), makes it current and switches its force output on. Throws
  /// std::runtime_error that says what to do.
  Slot& open(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const std::string shown = name.empty() ? "the default device" : "device '" + name + "'";
    if (users_ > 0)
      throw std::runtime_error("openhaptics: cannot open " + shown + ": open every device before the first one starts");
    Slot* slot = free_slot();
    if (slot == nullptr) throw std::runtime_error("openhaptics: cannot open " + shown + ": too many devices are open");
    discard_errors();
    const HHD device = hdInitDevice(name.empty() ? HD_DEFAULT_DEVICE : name.c_str());
    HDerror error = first_error();
    if (error == HD_SUCCESS && device == HD_INVALID_HANDLE) error = HD_COMM_CONFIG_ERROR;
    if (error != HD_SUCCESS) {
      if (device != HD_INVALID_HANDLE) hdDisableDevice(device);
      throw std::runtime_error("openhaptics: cannot open " + shown + ": " + describe(error));
    }
    hdMakeCurrentDevice(device);
    hdEnable(HD_FORCE_OUTPUT);
    error = first_error();
    if (error != HD_SUCCESS) {
      hdDisableDevice(device);
      throw std::runtime_error("openhaptics: cannot switch on the force output of " + shown + ": " + describe(error));
    }
    slot->trip.store(HD_SUCCESS, std::memory_order_relaxed);
    slot->fault.store(HD_SUCCESS, std::memory_order_relaxed);
    slot->device.store(device, std::memory_order_release);
    return *slot;
  }

  void close(Slot& slot) noexcept {
    const std::lock_guard lock(mutex_);
    const HHD device = slot.device.exchange(HD_INVALID_HANDLE, std::memory_order_acq_rel);
    if (users_ > 0) {
      to_close_[to_close_count_++ % kMaxDevices] = device;
    } else {
      hdDisableDevice(device);
      discard_errors();
    }
  }

  /// Schedules a callback and starts the scheduler for the first one. On an error nothing is left behind.
  HDerror start(HDSchedulerCallback callback, void* user, HDSchedulerHandle& handle) noexcept {
    const std::lock_guard lock(mutex_);
    const bool first = users_ == 0;
    // While the servo thread runs, the stack of errors is its own: a failure to schedule is then seen as silence.
    if (first) discard_errors();
    handle = hdScheduleAsynchronous(callback, user, HD_DEFAULT_SCHEDULER_PRIORITY);
    if (!first) {
      ++users_;
      return HD_SUCCESS;
    }
    HDerror error = first_error();
    if (error != HD_SUCCESS) return error;
    hdStartScheduler();
    error = first_error();
    if (error != HD_SUCCESS) {
      hdStopScheduler();
      hdUnschedule(handle);
      discard_errors();
      return error;
    }
    ++users_;
    return HD_SUCCESS;
  }

  /// Takes a callback back. `finished`: it has said so itself (HD_CALLBACK_DONE), and its handle is no longer valid.
  void stop(HDSchedulerHandle handle, bool finished) noexcept {
    const std::lock_guard lock(mutex_);
    if (--users_ > 0) {
      if (!finished) hdUnschedule(handle);
      return;
    }
    hdStopScheduler();
    if (!finished) hdUnschedule(handle);
    for (std::size_t i = 0; i < to_close_count_; ++i) hdDisableDevice(to_close_[i]);
    to_close_count_ = 0;
    discard_errors();
  }

  /// Pops all errors, a bounded number at once, and takes those of `mine`. Servo thread.
  trephine::DeviceStatus drain(Slot& mine, HDerror& fault) noexcept {
    for (int i = 0; i < kMaxErrors; ++i) {
      const HDErrorInfo info = hdGetError();
      if (!HD_DEVICE_ERROR(info)) break;
      Slot& slot = slot_of(info.hHD, mine);
      const bool trips = status_of(info.errorCode) == trephine::DeviceStatus::kSafetyTrip;
      (trips ? slot.trip : slot.fault).store(info.errorCode, std::memory_order_relaxed);
    }
    fault = mine.fault.exchange(HD_SUCCESS, std::memory_order_relaxed);
    const HDerror trip = mine.trip.exchange(HD_SUCCESS, std::memory_order_relaxed);
    return trephine::worse(status_of(fault), status_of(trip));
  }

  /// How many callbacks are scheduled.
  [[nodiscard]] int users() {
    const std::lock_guard lock(mutex_);
    return users_;
  }

 private:
  static constexpr int kMaxErrors = 64;

  Slot* free_slot() noexcept {
    for (Slot& slot : slots_)
      if (slot.device.load(std::memory_order_relaxed) == HD_INVALID_HANDLE) return &slot;
    return nullptr;
  }

  Slot& slot_of(HHD device, Slot& otherwise) noexcept {
    for (Slot& slot : slots_)
      if (device != HD_INVALID_HANDLE && slot.device.load(std::memory_order_acquire) == device) return slot;
    return otherwise;
  }

  static void discard_errors() noexcept { (void)first_error(); }

  /// The oldest error on the stack, which is where the trouble began; empties it.
  static HDerror first_error() noexcept {
    HDerror first = HD_SUCCESS;
    for (int i = 0; i < kMaxErrors; ++i) {
      const HDErrorInfo info = hdGetError();
      if (!HD_DEVICE_ERROR(info)) break;
      first = info.errorCode;
    }
    return first;
  }

  std::mutex mutex_;
  std::array<Slot, kMaxDevices> slots_;
  std::array<HHD, kMaxDevices> to_close_{};
  std::size_t to_close_count_ = 0;
  int users_ = 0;
};

}  // namespace openhaptics
