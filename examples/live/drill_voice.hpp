// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

namespace live {

/// What the drill does, as far as it is heard.
struct DrillState {
  bool spindle_on = false;
  double force = 0;          ///< on the hand [N]
  double removal_mm3_s = 0;  ///< bone cut [mm³/s]
};

/// The sound of a drill: a whine whose pitch follows the spindle and sinks under load, and the rasp of bone. 16-bit
/// mono samples; the same states give the same samples. One thread.
class DrillVoice {
 public:
  static constexpr int kRate = 44100;         ///< samples a second
  static constexpr double kIdlePitch = 420;   ///< of the free spindle [Hz]
  static constexpr double kSpoolTime = 0.12;  ///< time constant of start and stop [s]
  static constexpr double kLoadTime = 0.008;  ///< time constant of pitch and rasp under load [s]
  static constexpr double kStallForce = 8;    ///< [N]: pitch sinks by a third

  /// Goes on from the last call, toward `state`.
  void fill(std::span<std::int16_t> out, const DrillState& state) {
    const double target_speed = state.spindle_on ? 1 : 0;
    const double target_load = std::clamp(state.force / kStallForce, 0.0, 1.0);
    const double target_rasp = state.spindle_on ? std::clamp(state.removal_mm3_s / 20, 0.0, 1.0) : 0;
    constexpr double kSpool = 1 / (kSpoolTime * kRate), kLoad = 1 / (kLoadTime * kRate);
    for (std::int16_t& sample : out) {
      speed_ += kSpool * (target_speed - speed_);
      load_ += kLoad * (target_load - load_);
      rasp_ += kLoad * (target_rasp - rasp_);
      phase_ = std::fmod(phase_ + pitch() / kRate, 1.0);
      double whine = 0;
      for (std::size_t h = 0; h < kHarmonics.size(); ++h)
        whine += kHarmonics[h] * std::sin(2 * std::numbers::pi * phase_ * static_cast<double>(h + 1));
      state_ = state_ * 1664525U + 1013904223U;
      const double white = static_cast<double>(state_) / 2147483648.0 - 1;
      noise_ += 0.35 * (white - noise_);
      const double v = speed_ * ((0.10 + 0.12 * load_) * whine + 0.30 * rasp_ * noise_);
      sample = static_cast<std::int16_t>(std::lround(32767 * std::clamp(v, -1.0, 1.0)));
    }
  }
  /// Returns the present pitch [Hz].
  [[nodiscard]] double pitch() const { return kIdlePitch * speed_ * (1 - load_ / 3); }

 private:
  static constexpr std::array<double, 5> kHarmonics{1.0, 0.5, 0.33, 0.12, 0.18};
  double speed_ = 0, load_ = 0, rasp_ = 0, phase_ = 0, noise_ = 0;
  std::uint32_t state_ = 1;
};

}  // namespace live
