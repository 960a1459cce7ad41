// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace haply {

/// Why no force goes to the hand. Each has one line that says what the user should do.
enum class Trouble : std::uint8_t {
  kNone,
  kStart,    ///< no state is checked yet
  kSilent,   ///< a state is due
  kLost,     ///< the connection is closed
  kFull,     ///< the service takes no more bytes
  kMessage,  ///< no JSON, or not of a state's shape
  kTooFewDevices,
  kNotReady,
  kHandle,
  kRange,
  kJump,
  kFrozen,
  kFlood,
  kTick,  ///< the servo loop gives no new force
  kGivenUp,
};

[[nodiscard]] constexpr const char* text(Trouble trouble) noexcept {
  switch (trouble) {
    case Trouble::kNone:
      return "the device is good";
    case Trouble::kStart:
      return "waiting for the first good states: hold the handle still for a moment";
    case Trouble::kSilent:
      return "the service does not answer in time: close programs that load this machine, or restart the Haply Inverse "
             "Service";
    case Trouble::kLost:
      return "no connection to the service: start the Haply Inverse Service (Haply Hub does), and see that no other "
             "program has the port";
    case Trouble::kFull:
      return "the service takes no messages: restart the Haply Inverse Service";
    case Trouble::kMessage:
      return "the service sent no valid state: use the port of its simulation channel, 10001 unless configured "
             "otherwise, and a service of version 3.1 to 3.5";
    case Trouble::kTooFewDevices:
      return "the service has lost the Inverse3: check its USB cable and power supply";
    case Trouble::kNotReady:
      return "the Inverse3 is not ready: check its power supply and calibrate it, the handle in the inkwell";
    case Trouble::kHandle:
      return "the handle gives no orientation: move it to wake it, charge it, or pair it again in Haply Hub";
    case Trouble::kRange:
      return "the service sent a position or velocity out of the arm's reach: calibrate the Inverse3 and check that "
             "the "
             "workspace is not scaled";
    case Trouble::kJump:
      return "the position jumped: move slower; if it stays, calibrate the Inverse3";
    case Trouble::kFrozen:
      return "the service repeats one position while the arm moves: reconnect the Inverse3's USB cable";
    case Trouble::kFlood:
      return "the service sends states that nobody asked for: end other programs that use it, and restart it";
    case Trouble::kTick:
      return "the servo loop was late with a force: close programs that load this machine, or build with optimisation";
    case Trouble::kGivenUp:
      return "the service did not come back: start the Haply Inverse Service, then this program";
  }
  return "unknown trouble";
}

}  // namespace haply
