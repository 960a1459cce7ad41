// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/cutting_sound.hpp>

#include <algorithm>
#include <numbers>

namespace live {

/// What of a drill is heard, as `trephine::CuttingSound` plays it: a spindle that starts, stops and sinks under load,
/// and teeth that are louder where they press and remove bone. Haptic thread.
class HeardDrill {
 public:
  static constexpr int kTeeth = 6;
  static constexpr double kIdlePitch = 420;   ///< of the free spindle's teeth [Hz]
  static constexpr double kSpoolTime = 0.12;  ///< time constant of start and stop [s]
  static constexpr double kLoadTime = 0.008;  ///< time constant of load and removal [s]
  static constexpr double kStallForce = 8;    ///< [N]: pitch sinks by a third
  static constexpr double kFullRemoval = 20;  ///< [mm³/s]: the loudest
  static constexpr trephine::CuttingSound::Options kOptions{.gain = 1, .pattern = {.runout = 0.2}};

  /// Returns what is heard after a tick of `dt` seconds with this force on the hand [N].
  [[nodiscard]] trephine::CuttingSoundState after(bool spindle_on, double force, double removed_mm3,
                                                  double dt) noexcept {
    const auto approach = [dt](double& value, double to, double time) {
      value += std::min(1.0, dt / time) * (to - value);
    };
    approach(speed_, spindle_on ? 1 : 0, kSpoolTime);
    approach(pressed_, std::min(1.0, force / kStallForce), kLoadTime);
    approach(removal_, spindle_on ? removed_mm3 / dt / kFullRemoval : 0, kLoadTime);
    if (speed_ < kSilentSpeed) return {};
    const double turns = kIdlePitch / kTeeth * speed_ * (1 - pressed_ / 3);
    const double loudness = speed_ * (0.10 + 0.12 * pressed_ + 0.25 * std::min(1.0, removal_));
    return {.spindle = 2 * std::numbers::pi * turns, .load = loudness, .teeth = kTeeth};
  }

 private:
  static constexpr double kSilentSpeed = 1e-3;  // of the free spindle's
  double speed_ = 0, pressed_ = 0, removal_ = 0;
};

}  // namespace live
