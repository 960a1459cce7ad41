// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>

#include <cstddef>

#include <HD/hd.h>

#include <array>
#include <cstdio>
#include <string>

/// What the driver's errors mean for a servo loop, and what a person can do about them.
namespace openhaptics {

/// Codes of the adapter's own, outside the driver's range.
inline constexpr HDerror kNonFiniteCommand = 0xFFFF0001;
inline constexpr HDerror kNonFinitePose = 0xFFFF0002;

/// Safety trips pass: the amplifiers drop and come back. All else means that the force on the hand is no longer known
/// to be the one that was asked for, also codes that nobody has told us about: stop.
[[nodiscard]] constexpr trephine::DeviceStatus status_of(HDerror code) noexcept {
  switch (code) {
    case HD_SUCCESS:
      return trephine::DeviceStatus::kOk;
    case HD_WARM_MOTORS:
    case HD_EXCEEDED_MAX_FORCE:
    case HD_EXCEEDED_MAX_FORCE_IMPULSE:
    case HD_EXCEEDED_MAX_VELOCITY:
    case HD_FORCE_ERROR:
      return trephine::DeviceStatus::kSafetyTrip;
    default:
      return trephine::DeviceStatus::kFault;
  }
}

/// One sentence: what happened and what to do.
[[nodiscard]] constexpr const char* advice(HDerror code) noexcept {
  switch (code) {
    case HD_SUCCESS:
      return "no error";
    case HD_WARM_MOTORS:
      return "the motors are hot: let the device rest for some minutes, and press less";
    case HD_EXCEEDED_MAX_FORCE:
    case HD_EXCEEDED_MAX_FORCE_IMPULSE:
    case HD_FORCE_ERROR:
      return "the force was more than the device bears: lower the stiffness or the force limit";
    case HD_EXCEEDED_MAX_VELOCITY:
      return "the handle moved too fast: hold it before the force comes back";
    case HD_DEVICE_FAULT:
      return "the device reports a fault: switch it off and on, then run the vendor's diagnostic program";
    case HD_DEVICE_ALREADY_INITIATED:
      return "the device is open already: close the other program, or give another device's name";
    case HD_COMM_ERROR:
      return "communication with the device was lost: check its cable and power, then start again";
    case HD_COMM_CONFIG_ERROR:
      return "the device was not found: check cable, power and permission, pair it with the vendor's setup program, "
             "and "
             "give the name it was set up with";
    case HD_TIMER_ERROR:
      return "the driver's servo timer failed: close other programs that use the device, then start again";
    case HD_ILLEGAL_BEGIN:
    case HD_ILLEGAL_END:
    case HD_FRAME_ERROR:
      return "a frame was opened or closed out of order: another callback of this program drives the same device";
    case HD_INVALID_PRIORITY:
    case HD_SCHEDULER_FULL:
      return "the driver's scheduler took no further callback: stop other callbacks of this program";
    case HD_INVALID_LICENSE:
      return "the driver refuses its licence: see the vendor's licence manager";
    case HD_BAD_HANDLE:
      return "the device was closed while in use";
    case kNonFiniteCommand:
      return "the command was not a finite number: a force law overflowed";
    case kNonFinitePose:
      return "the device gave a pose that is no finite number: switch it off and on, then calibrate it";
    default:
      return "the driver reports an error that this adapter does not know: see the vendor's manual";
  }
}

/// Code, the driver's own words and the advice, for a person. Allocates; not for the servo thread.
[[nodiscard]] inline std::string describe(HDerror code) {
  if (code == HD_SUCCESS) return advice(code);
  if (code == kNonFiniteCommand || code == kNonFinitePose) return advice(code);
  std::array<char, 16> hex{};
  std::snprintf(hex.data(), hex.size(), "0x%04X", code);
  const HDstring words = hdGetErrorString(code);
  return std::string(advice(code)) + " (driver's error " + hex.data() +
         (words != nullptr ? std::string(", ") + words : "") + ")";
}

}  // namespace openhaptics
