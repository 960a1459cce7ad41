// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/wrench.hpp>

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>

/// The interface between the servo loop and haptic devices. Frames: D is the device's base, as its driver defines it,
/// in metres. H is the device's reference point on the handle: its position readings and its torque refer to H.
namespace trephine::inline TREPHINE_ALIGNED {

/// Status that `read` and `write` return.
enum class DeviceStatus : std::uint8_t {
  kOk = 0,
  kSafetyTrip = 1,  ///< the device protects itself (hot motors, force or speed limit): keep ticking, send zero
  kFault = 2,       ///< the device is lost or broken (communication, timer, non-finite command): stop
};

[[nodiscard]] constexpr DeviceStatus worse(DeviceStatus a, DeviceStatus b) noexcept { return a < b ? b : a; }

[[nodiscard]] constexpr const char* to_string(DeviceStatus s) noexcept {
  switch (s) {
    case DeviceStatus::kOk:
      return "ok";
    case DeviceStatus::kSafetyTrip:
      return "safety_trip";
    case DeviceStatus::kFault:
      return "fault";
  }
  return "unknown";
}

/// Capabilities of an open device. Zero means unknown, except for the degrees of freedom.
struct DeviceCapabilities {
  std::string name = "device";
  int input_dof = 6;             ///< 3: position; 6: position and rotation
  int output_dof = 6;            ///< 0: none; 3: force; 6: force and torque
  double max_force = 0;          ///< [N], about H
  double max_torque = 0;         ///< [N·m], about H
  double stiffness = 0;          ///< largest stiffness it renders stably at `rate` [N/m]
  double angular_stiffness = 0;  ///< the same for rotation [N·m/rad]
  double rate = 0;               ///< nominal servo rate [Hz]
};

/// A reading of the handle: pose and buttons. A device with three input degrees of freedom leaves the rotation at
/// identity.
struct DeviceState {
  Posed X_DH = Posed::Identity();  ///< the handle's pose in the device's base frame [m]
  std::uint32_t buttons = 0;       ///< bit i: button i is down
  std::optional<double> time;      ///< the device's own time of this pose [s], if it has a clock, which dt then follows
};

/// A haptic device that exchanges poses and wrenches: a polled device, or the data part of a self-paced device. Its
/// constructor opens the hardware and throws if that fails. The haptic thread alone calls both functions:
/// - `read(state)` reads the pose. On kSafetyTrip the state is valid; on kFault it is ignored.
/// - `write(wrench)` applies force [N] and torque [N·m], about H in D axes, until the next write. It clamps to the
///   hardware's limits. For a non-finite wrench it applies none and returns kFault.
///
/// A tick is one read, then one write, for every status of the read: an adapter may open a frame in `read` and commit
/// it in `write`. After a fault a single write of zero may follow, as a last resort; a device that cannot perform it
/// returns kFault and changes nothing. Neither call allocates, locks or waits longer than the hardware's exchange.
/// `capabilities` is called outside the loop and may allocate.
template <class D>
concept HapticDevice = requires(D& device, const D& constant, DeviceState& state, const Wrenchd& wrench_H_D) {
  { constant.capabilities() } -> std::convertible_to<DeviceCapabilities>;
  { device.read(state) } noexcept -> std::same_as<DeviceStatus>;
  { device.write(wrench_H_D) } noexcept -> std::same_as<DeviceStatus>;
};

/// Callback of a self-paced device, called once a servo tick in its own thread. It returns true to continue, false
/// after the last tick. A plain function with an argument, so that C schedulers can call it.
using ServoCallback = bool (*)(void* user) noexcept;

/// A device with a scheduler of its own (OpenHaptics HD), which calls the servo loop. Additional functions:
/// - `start(callback, user)` starts the calls and returns; kFault means that it failed.
/// - `stop()` returns when no call is running or will follow, with no force on the hand. It is safe to call twice, and
///   after a failed start.
///
/// The controlling thread calls both; the callback calls `read` and `write`. So the force is committed in the tick that
/// read the pose, which gives three times the stable stiffness of a commit one tick later.
template <class D>
concept SelfPacedDevice = HapticDevice<D> && requires(D& device, ServoCallback callback, void* user) {
  { device.start(callback, user) } noexcept -> std::same_as<DeviceStatus>;
  { device.stop() } noexcept;
};

/// A simulated device whose time passes only when `advance(dt)` [s] is called; the loop does so before each reading.
template <class D>
concept AdvancedDevice =
    HapticDevice<D> && !SelfPacedDevice<D> && requires(D& device, double dt) { device.advance(dt); };

}  // namespace trephine
