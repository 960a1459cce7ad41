// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>

#include <atomic>
#include <cstdint>
#include <string>

namespace openhaptics {

/// A clutch on a button, for workspaces smaller than the scene: while it is held the tool stays where it is and the
/// hand moves on without force; when it is let go they are joined again at the new place. Only places are uncoupled:
/// the tool keeps turning with the handle.
///
/// While held, and in the tick that ends it, a reading is answered as a safety trip: the servo loop then sends zero and
/// ramps the wrench back. All other buttons read as released, so that nothing is cut blindly.
///
/// Wraps any device, polled or self-paced, which must outlive it; `held` from any thread, the rest as the device.
template <trephine::HapticDevice Device>
class Clutched {
 public:
  Clutched(Device& device, std::uint32_t button) : device_(device), button_(button) {}

  [[nodiscard]] trephine::DeviceCapabilities capabilities() const { return device_.capabilities(); }

  [[nodiscard]] trephine::DeviceStatus read(trephine::DeviceState& state) noexcept {
    const trephine::DeviceStatus status = device_.read(state);
    if (status == trephine::DeviceStatus::kFault) return status;
    const trephine::Vec3d p_DH = state.X_DH.translation();
    if (!trephine::is_finite(p_DH)) return status;  // the device says so itself
    const bool was_held = held_.load(std::memory_order_relaxed);
    const bool is_held = (state.buttons & button_) != 0;
    held_.store(is_held, std::memory_order_relaxed);
    if (is_held && !was_held) frozen_ = p_DH + offset_;
    if (is_held || was_held) offset_ = frozen_ - p_DH;
    state.X_DH.translation() = p_DH + offset_;
    if (!is_held && !was_held) return status;
    state.buttons &= button_;
    return trephine::worse(status, trephine::DeviceStatus::kSafetyTrip);
  }

  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept { return device_.write(wrench_H_D); }

  trephine::DeviceStatus start(trephine::ServoCallback callback, void* user) noexcept
    requires trephine::SelfPacedDevice<Device>
  {
    return device_.start(callback, user);
  }
  void stop() noexcept
    requires trephine::SelfPacedDevice<Device>
  {
    device_.stop();
  }

  [[nodiscard]] std::string fault_text() const
    requires requires(const Device& d) { d.fault_text(); }
  {
    return device_.fault_text();
  }

  [[nodiscard]] bool held() const noexcept { return held_.load(std::memory_order_relaxed); }
  /// What the tool is ahead of the hand [m], in D. Not while the loop runs.
  [[nodiscard]] const trephine::Vec3d& offset() const noexcept { return offset_; }

 private:
  Device& device_;
  std::uint32_t button_;
  trephine::Vec3d offset_ = trephine::Vec3d::Zero();
  trephine::Vec3d frozen_ = trephine::Vec3d::Zero();
  std::atomic<bool> held_{false};
};

}  // namespace openhaptics
