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
  int teeth = 0;       ///< 0: a diamond's grains
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
/// late. Other teeth start after a buffer in which the old ones fade. It has no resonances of a room, and no motor.
/// Without new states the last one goes on, so post one after the spindle stops.
///
/// *Path.* A mass on a spring passes on 12 dB less an octave above its resonance. Two in a row, as a handpiece and a
/// skull, are a low-pass of fourth order, 1/√(1 + (f/corner)⁸) without a delay. Its corner and the teeth's spread are
/// fitted to a burr of 6.5 mm on mastoid cortex: 24 dB less from 4 to 8 kHz, then 44 dB less to 16 kHz (Hilmi, Otol
/// Neurotol). Octaves in the mean over 30 to 80 krpm are within 4 dB of that, A-weighted; a single speed has its lines.
/// At one push the torque is the same at each speed, so a faster spindle is quieter because its lines lie higher (as
/// Banakis Hartl et al. measured, Otol Neurotol 2017, 38:938).
///
/// |sample| ≤ gain · load · `ToothLines::peak`. One thread at a time; no allocation, lock or wait.
class CuttingSound {
 public:
  struct Options {
    double gain = 50;  ///< signal by torque [1/(N·m)], >= 0
    ToothPattern pattern{.spread = 0.5};
    double corner = 2500;  ///< of the path [Hz], > 0; infinite: no path

    /// Throws std::invalid_argument.
    void validate() const {
      pattern.validate();
      if (!(gain >= 0) || !is_finite(gain)) refuse("CuttingSound", "gain must be finite and >= 0 per N·m", gain);
      if (!(corner > 0)) refuse("CuttingSound", "corner must be > 0 Hz", corner);
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
    const double by_corner = rate / (2 * std::numbers::pi * options_.corner);
    const auto path = [by_corner](double angle) {
      const double square = angle * angle * by_corner * by_corner, fourth = square * square;
      return 1 / std::sqrt(1 + fourth * fourth);
    };
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double part = static_cast<double>(i + 1) * step;
      const double advance = (now_.spindle + part * (to.spindle - now_.spindle)) / rate;
      const double load = now_.load + part * (to.load - now_.load);
      angle_ = std::fmod(angle_ + advance, 2 * std::numbers::pi);
      out[i] = static_cast<float>(options_.gain * load * lines_.sample(angle_, advance, path));
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
