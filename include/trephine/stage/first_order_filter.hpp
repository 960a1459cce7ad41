// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <cmath>
#include <numbers>

namespace trephine {

/// Low-pass of first order on force and torque: y += α (u − y) with α = 1 − exp(−2π f dt), the exact solution for a
/// wrench that is constant over the tick. The step response is 1 − exp(−2π f t) at every tick rate, steady or not, and
/// a constant wrench passes unchanged (DC gain 1, to rounding). A cut-off far beyond the tick rate passes every wrench
/// to the bit.
///
/// It costs phase: slow signals come 1/(2π f) late, 1.6 ms at 100 Hz, and delay is what makes stiff walls unstable (a
/// tick of delay divides the stable stiffness by about three). Filter lightly, or not at all. After contact ends the
/// wrench fades over a few 1/(2π f) instead of ending at once.
///
/// State: the last output, zero at the start and after `reset`. Haptic thread.
class FirstOrderFilter {
 public:
  static constexpr bool kUsesTwist = false;

  struct Options {
    double cutoff = 200;  ///< f, where the gain is 1/√2 [Hz], > 0

    /// Throws std::invalid_argument.
    void validate() const {
      if (!(cutoff > 0) || !std::isfinite(cutoff))
        refuse("FirstOrderFilter", "cutoff must be finite and > 0 Hz", cutoff);
    }
    /// How late a slow signal comes out [s].
    [[nodiscard]] double delay() const noexcept { return 1 / (2 * std::numbers::pi * cutoff); }
  };

  /// Throws std::invalid_argument where the cut-off is out of range.
  explicit FirstOrderFilter(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Takes options that `validate` accepted, without a step in the output; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void reset() noexcept { state_ = Wrenchd::zero(); }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const double kept = std::exp(-2 * std::numbers::pi * options_.cutoff * context.dt);  // 1 − α
    follow(kept, wrench.force, state_.force);
    follow(kept, wrench.torque, state_.torque);
    wrench = state_;
  }

 private:
  static void follow(double kept, const Vec3d& in, Vec3d& out) noexcept {
    constexpr double kGone = 1e-12;  // [N, N·m]; ends the fade, which would linger in slow denormal numbers
    for (int i = 0; i < 3; ++i) {
      out[i] = in[i] + kept * (out[i] - in[i]);
      if (in[i] == 0 && std::abs(out[i]) < kGone) out[i] = 0;
    }
  }

  Options options_;
  Wrenchd state_;
};

}  // namespace trephine
