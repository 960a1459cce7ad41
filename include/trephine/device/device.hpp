// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/wrench.hpp>

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>

/// What the servo loop asks of a haptic device. Frames: D is the device's base, as its driver defines it, in metres; H
/// is the device's own reference point on the handle (the point its position reading means and its torque is about).
namespace trephine {

/// What `read` and `write` answer.
enum class DeviceStatus : std::uint8_t {
  kOk = 0,
  kSafetyTrip = 1,  ///< the device protects itself for a while (hot motors, force or speed limit): tick on, send zero
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

/// What a device can do, known once it is open. Zero means unknown for every figure but the degrees of freedom.
struct DeviceCapabilities {
  std::string name = "device";
  int input_dof = 6;             ///< 3: position; 6: position and rotation
  int output_dof = 6;            ///< 0: none; 3: force; 6: force and torque
  double max_force = 0;          ///< [N], about H
  double max_torque = 0;         ///< [N·m], about H
  double stiffness = 0;          ///< largest stiffness it renders stably at `rate` [N/m]
  double angular_stiffness = 0;  ///< the same for rotation [N·m/rad]
  double rate = 0;               ///< servo rate it is made for [Hz]
};

/// One reading. A device of three input degrees of freedom leaves the rotation at identity.
struct DeviceState {
  Posed X_DH = Posed::Identity();  ///< the handle's pose in the device's base frame [m]
  std::uint32_t buttons = 0;       ///< bit i: button i is down
  std::optional<double> time;      ///< the device's own time of this pose [s], where it has one: dt then comes from it
};

/// A polled device, or the part of a self-paced one that moves data. It is open before a loop runs it: its constructor
/// opens it, and throws where it cannot. Both calls come from the haptic thread alone:
/// - `read(state)` takes the pose. On kSafetyTrip the state is valid; on kFault it is not looked at.
/// - `write(wrench)` applies force [N] and torque [N·m], about H in D axes, until the next write. It clamps to what the
///   hardware bears, and answers kFault on a non-finite wrench after applying none.
///
/// One tick is one read, then one write, whatever the read answered: an adapter may open a frame in `read` and commit
/// it in `write`. A write of zero may also come alone, as a last resort after a fault; a device that cannot do that
/// answers kFault and changes nothing. Neither call allocates, locks or waits longer than the hardware's exchange.
/// `capabilities` is called outside the loop and may allocate.
template <class D>
concept HapticDevice = requires(D& device, const D& constant, DeviceState& state, const Wrenchd& wrench_H_D) {
  { constant.capabilities() } -> std::convertible_to<DeviceCapabilities>;
  { device.read(state) }
  noexcept->std::same_as<DeviceStatus>;
  { device.write(wrench_H_D) }
  noexcept->std::same_as<DeviceStatus>;
};

/// What a self-paced device calls once a servo tick, in its own thread: true asks for more, false is the last call.
/// A plain function and its argument, so that a C scheduler can carry it.
using ServoCallback = bool (*)(void* user) noexcept;

/// A device that calls back from a scheduler of its own (OpenHaptics HD), in addition:
/// - `start(callback, user)` begins the calls and returns; kFault: it could not.
/// - `stop()` returns when no call is running or will come, with no force on the hand. Safe to call twice, and after a
///   start that failed.
///
/// Both come from the controlling thread, `read` and `write` from inside the callback: the force is committed in the
/// tick that read the pose, which is worth a factor of three in stable stiffness over one tick later.
template <class D>
concept SelfPacedDevice = HapticDevice<D> && requires(D& device, ServoCallback callback, void* user) {
  { device.start(callback, user) }
  noexcept->std::same_as<DeviceStatus>;
  { device.stop() }
  noexcept;
};

/// A simulated device whose time passes only when `advance(dt)` [s] is called; the loop does so before each reading.
template <class D>
concept AdvancedDevice = HapticDevice<D> && !SelfPacedDevice<D> && requires(D & device, double dt) {
  device.advance(dt);
};

}  // namespace trephine
