// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/device/device.hpp>
#include <trephine/device/realtime.hpp>

#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a servo loop, fixed at its construction.
struct ServoOptions {
  /// Tick rate [Hz]; 0: the device's nominal rate, or 1000 if unknown. For a self-paced device it is the expected rate.
  double rate = 0;
  /// Duration of the ramp from zero to the full wrench after a start, a trip or a jump [s].
  double ramp = 0.1;
  /// Longest regular interval between readings [s]. A longer interval is a stall: the hand has moved, so the wrench is
  /// ramped.
  double stall_time = 0.02;
  /// Longest time without a call of a self-paced device [s]; a longer silence is a fault.
  double callback_timeout = 1.0;
  /// The spindle turns while one of these buttons is down.
  std::uint32_t spindle_buttons = 1;
  /// Measure tick and processor times. It costs about 1 µs a tick, mostly the system call for processor time.
  bool measure = true;
  /// Thread settings for polled devices in real time.
  RealtimeOptions realtime{};
};

/// Returns the rate of the loop [Hz]. Throws std::invalid_argument if an option is out of range.
[[nodiscard]] inline double servo_rate(const ServoOptions& options, const DeviceCapabilities& device) {
  const auto positive = [](double v, const char* rule) {
    if (!(v > 0) || !is_finite(v)) refuse("ServoLoop", rule, v);
  };
  if (!(options.ramp >= 0) || !is_finite(options.ramp)) refuse("ServoLoop", "ramp must be >= 0 s", options.ramp);
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
