// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/device/device.hpp>
#include <trephine/device/realtime.hpp>

#include <cmath>
#include <cstdint>

namespace trephine {

/// Numbers of a servo loop; fixed at its construction.
struct ServoOptions {
  /// [Hz]; 0: the device's own, or 1000 where it does not tell. A self-paced device keeps its own pace, this then says
  /// what it is expected to be.
  double rate = 0;
  /// How long the wrench takes from zero to full after a start, a trip or a jump [s].
  double ramp = 0.1;
  /// An interval between readings longer than this [s] is a stall: the hand has moved on, the wrench is ramped.
  double stall_time = 0.02;
  /// A self-paced device that does not call for this long [s] is a fault.
  double callback_timeout = 1.0;
  /// The spindle turns while one of these buttons is down.
  std::uint32_t spindle_buttons = 1;
  /// Take tick and processor times (about 1 µs a tick, most of it the system call for processor time).
  bool measure = true;
  /// For polled devices in real time.
  RealtimeOptions realtime{};
};

/// The rate the loop runs at [Hz]. Throws std::invalid_argument on options out of range.
[[nodiscard]] inline double servo_rate(const ServoOptions& options, const DeviceCapabilities& device) {
  const auto positive = [](double v, const char* rule) {
    if (!(v > 0) || !std::isfinite(v)) refuse("ServoLoop", rule, v);
  };
  if (!(options.ramp >= 0) || !std::isfinite(options.ramp)) refuse("ServoLoop", "ramp must be >= 0 s", options.ramp);
  positive(options.stall_time, "stall_time must be > 0 s");
  positive(options.callback_timeout, "callback_timeout must be > 0 s");
  if (options.realtime.priority < 0 || options.realtime.priority > 99)
    refuse("ServoLoop", "real-time priority must be in 0..99", options.realtime.priority);
  const double rate = options.rate != 0 ? options.rate : device.rate > 0 ? device.rate : 1000.0;
  const bool in_range = rate >= 1.0 / kLongestDt && rate <= 1.0 / kShortestDt;
  if (!in_range) refuse("ServoLoop", "rate must be in 10..100000 Hz", rate);
  return rate;
}

}  // namespace trephine
