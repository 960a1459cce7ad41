// SPDX-License-Identifier: MIT
#pragma once

#include "motion_events.hpp"

#include <trephine/device/device.hpp>
#include <trephine/device/pacing.hpp>

#include <algorithm>
#include <chrono>
#include <string>

namespace spacemouse {

/// A 6-DOF mouse as a polled device of no output: for trying scenes by hand without haptic hardware, and for the
/// camera's hand beside one. The loop says that it will not be felt; writes are accepted and do nothing.
///
/// `read` takes all events that wait (a bounded number), lets the time since the last reading pass at the deflection
/// held meanwhile, and gives the pose. A driver that is gone is a fault. Neither call waits or allocates. The source
/// must outlive the device. One thread.
template <EventSource Source>
class Device {
 public:
  static constexpr int kMaxEvents = 64;        // a reading; what is left waits for the next one
  static constexpr double kLongestStep = 0.1;  // [s]: after a pause the tool does not leap

  explicit Device(Source& source, const Gains& gains = {},
                  const trephine::Posed& X_DH = trephine::Posed::Identity()) noexcept
      : source_(source), integrator_(gains, X_DH) {}

  [[nodiscard]] trephine::DeviceCapabilities capabilities() const {
    return {.name = "6-DOF mouse", .input_dof = 6, .output_dof = 0, .rate = 1000};
  }

  [[nodiscard]] trephine::DeviceStatus read(trephine::DeviceState& state) noexcept {
    const auto now = trephine::ServoClock::now();
    const double passed = started_ ? std::chrono::duration<double>(now - last_).count() : 0.0;
    started_ = true;
    last_ = now;
    return read_after(passed, state);
  }

  /// The same with the time since the last reading given [s]: for tests and replays.
  [[nodiscard]] trephine::DeviceStatus read_after(double passed, trephine::DeviceState& state) noexcept {
    if (lost_) return trephine::DeviceStatus::kFault;
    integrator_.advance(std::clamp(passed, 0.0, kLongestStep));
    for (int i = 0; i < kMaxEvents; ++i) {
      const Event event = source_.next();
      if (event.kind == Event::kNone) break;
      take(event);
      if (lost_) return trephine::DeviceStatus::kFault;
    }
    state.X_DH = integrator_.pose();
    state.buttons = buttons_;
    state.time.reset();
    return trephine::DeviceStatus::kOk;
  }

  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept {
    return trephine::is_finite(wrench_H_D) ? trephine::DeviceStatus::kOk : trephine::DeviceStatus::kFault;
  }

  [[nodiscard]] std::string fault_text() const {
    return lost_ ? "the spacenav driver closed the connection: see that spacenavd runs, then start again" : "";
  }

 private:
  void take(const Event& event) noexcept {
    if (event.kind == Event::kLost) lost_ = true;
    if (event.kind == Event::kMotion) integrator_.deflect(event.deflection);
    if (event.kind == Event::kButton && event.button >= 0 && event.button < 32) {
      const std::uint32_t bit = std::uint32_t{1} << event.button;
      buttons_ = event.pressed ? buttons_ | bit : buttons_ & ~bit;
    }
  }

  Source& source_;
  RateIntegrator integrator_;
  std::uint32_t buttons_ = 0;
  bool started_ = false;
  bool lost_ = false;
  trephine::ServoClock::time_point last_{};
};

}  // namespace spacemouse
