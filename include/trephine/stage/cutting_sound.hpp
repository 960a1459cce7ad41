// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/tool/tooth_lines.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Cutting as the sound needs it; the haptic thread posts it, each tick or less often.
struct CuttingSoundState {
  double spindle = 0;  ///< [rad/s]
  double load = 0;     ///< mean torque of cutting [N·m]
  int teeth = 0;
};

/// The state for a sound after a tick.
[[nodiscard]] inline CuttingSoundState sound_of(const CuttingReport& report, const CuttingEdges& edges) noexcept {
  return {report.spindle, report.torque, ToothLines::teeth_of(edges)};
}

/// The sound of cutting teeth, for a host's audio thread: the ripple of the torque, by the same `ToothLines` as the
/// vibration in the hand, at the audio's rate. So pitch falls as the load slows the spindle.
/// \code
/// Mailbox<CuttingSoundState> box;
/// CuttingSound sound({.gain = 50}, box);
/// box.post(sound_of(cutting.report(), cutting.options().edges));  // haptic thread, after a tick
/// sound.fill(samples, 48'000);                                    // audio thread, buffer after buffer
/// \endcode
/// Load and speed go in a straight line over a buffer to the latest state, so nothing clicks; the sound is a buffer
/// late. Other teeth start after a buffer in which the old ones fade. It is a source, without the bone's, the
/// handpiece's or the room's resonances, and without the motor: filter it as you like. Without new states the last one
/// goes on, so post one after the spindle stops.
///
/// |sample| ≤ gain · load · `ToothLines::peak`. One thread at a time; no allocation, lock or wait.
class CuttingSound {
 public:
  struct Options {
    double gain = 50;  ///< signal by torque [1/(N·m)], >= 0
    ToothPattern pattern{};

    /// Throws std::invalid_argument.
    void validate() const {
      pattern.validate();
      if (!(gain >= 0) || !is_finite(gain)) refuse("CuttingSound", "gain must be finite and >= 0 per N·m", gain);
    }
  };

  /// `inbox` must outlive the sound. Throws std::invalid_argument.
  CuttingSound(const Options& options, Mailbox<CuttingSoundState>& inbox) : options_(options), inbox_(&inbox) {
    options_.validate();
  }

  /// Writes the next samples, at `rate` a second. Zeros for a rate that is not > 0.
  void fill(std::span<float> out, double rate) noexcept {
    if (const CuttingSoundState* latest = inbox_->take()) target_ = usable(*latest);
    if (out.empty()) return;
    if (!(rate > 0) || !(now_.load > 0 || target_.load > 0)) return std::fill(out.begin(), out.end(), 0.0F);
    CuttingSoundState to = target_;
    if (!(now_.load > 0)) {
      now_ = {to.spindle, 0, to.teeth};
      lines_ = ToothLines(to.teeth, options_.pattern);
    } else if (to.teeth != now_.teeth) {
      to = {now_.spindle, 0, now_.teeth};
    }
    const double step = 1 / static_cast<double>(out.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double part = static_cast<double>(i + 1) * step;
      const double advance = (now_.spindle + part * (to.spindle - now_.spindle)) / rate;
      const double load = now_.load + part * (to.load - now_.load);
      angle_ = std::fmod(angle_ + advance, 2 * std::numbers::pi);
      out[i] = static_cast<float>(options_.gain * load * lines_.sample(angle_, advance));
    }
    now_ = to;
  }

 private:
  /// A state without numbers that are not finite or below 0, which are silent.
  [[nodiscard]] static CuttingSoundState usable(const CuttingSoundState& s) noexcept {
    if (!(s.spindle >= 0) || !(s.load >= 0) || !is_finite(s.spindle) || !is_finite(s.load)) return {};
    return {s.spindle, s.load, std::max(0, s.teeth)};
  }

  Options options_;
  Mailbox<CuttingSoundState>* inbox_;
  CuttingSoundState now_, target_;
  ToothLines lines_;
  double angle_ = 0;  // of the spindle, in [0, 2π)
};

}  // namespace trephine
