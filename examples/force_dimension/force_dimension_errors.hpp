// SPDX-License-Identifier: MIT
#pragma once

#include <dhdc.h>

#include <string>

/// What a fault or a trip of a Force Dimension device means, and what a person can do about it.
namespace force_dimension {

/// Codes of the adapter's own, outside the driver's range.
inline constexpr int kNonFiniteCommand = 0x10001;
inline constexpr int kNoPose = 0x10002;
inline constexpr int kStalePose = 0x10003;
inline constexpr int kUnpowered = 0x10004;
inline constexpr int kDeviceError = 0x10005;

/// Why the adapter sends no force although the device works.
enum class Trip : int {
  kNone,
  kUncalibrated,  ///< the pose is not to be believed
  kBrake,         ///< the device brakes: its handle was too fast, or its program was late
  kButton,        ///< a person switched the force off
  kJump,          ///< the pose moved faster than a hand can
  kLate,          ///< the command belonged to a pose too old
};

[[nodiscard]] constexpr const char* advice(Trip trip) noexcept {
  switch (trip) {
    case Trip::kNone:
      return "";
    case Trip::kUncalibrated:
      return "calibrate: put the handle's pole into the calibration pit, and turn a wrist to its stops";
    case Trip::kBrake:
      return "the device brakes: hold the handle still until the force comes back";
    case Trip::kButton:
      return "the force is switched off: press the device's force button";
    case Trip::kJump:
      return "the pose jumped: calibrate again if this recurs";
    case Trip::kLate:
      return "a command was late: close other programs";
  }
  return "";
}

/// Returns one sentence for a fault: what happened and what to do.
[[nodiscard]] constexpr const char* advice(int code) noexcept {
  switch (code) {
    case DHD_NO_ERROR:
      return "no error";
    case DHD_ERROR_COM:
    case DHD_ERROR_TIMEOUT:
      return "communication with the device was lost: check its cable and power, then start again";
    case DHD_ERROR_DHC_BUSY:
    case DHD_ERROR_DEVICE_NOT_READY:
      return "the device is not ready: wait until its lamp is steady, then start again";
    case DHD_ERROR_NO_DRIVER_FOUND:
      return "the driver is missing: install the vendor's, or on Linux its rule for USB permissions";
    case DHD_ERROR_NO_DEVICE_FOUND:
      return "the device was not found: check cable, power and permission";
    case DHD_ERROR_NOT_AVAILABLE:
      return "the device cannot do what was asked of it, or another program has it: close that, then start again";
    case kNonFiniteCommand:
      return "the command was not a finite number: a force law overflowed";
    case kNoPose:
      return "the device gave a pose that is none: switch it off and on, then calibrate it";
    case kStalePose:
      return "the device gave no new pose in time: let no other program or thread read it, and check its cable";
    case kUnpowered:
      return "the device has no power or is unplugged: check both, then start again";
    case kDeviceError:
      return "the device reports an error: switch it off and on, then run the vendor's test program";
    default:
      return "the driver reports an error that this adapter does not know: see the vendor's manual";
  }
}

/// Returns the advice, with the driver's own code and words where it is the driver's. Allocates.
[[nodiscard]] inline std::string describe(int code) {
  if (code == DHD_NO_ERROR || code > 0x10000) return advice(code);
  const char* words = dhdErrorGetStr(code);
  return std::string(advice(code)) + " (driver's error " + std::to_string(code) +
         (words != nullptr ? std::string(", ") + words : "") + ")";
}

}  // namespace force_dimension
