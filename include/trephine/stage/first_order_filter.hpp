// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <cmath>
#include <numbers>

namespace trephine::inline TREPHINE_ALIGNED {

/// First-order low-pass filter of force and torque: y += α (u − y) with α = 1 − exp(−2π f dt). This is the exact
/// solution for a wrench that is constant over the tick. The step response is 1 − exp(−2π f t) at every tick rate,
/// steady or not, and a constant wrench passes unchanged (DC gain 1, to rounding). A cut-off far above the tick rate
/// passes every wrench to the bit.
///
/// The price is phase lag: slow signals are delayed by 1/(2π f), 1.6 ms at 100 Hz. Delay makes stiff walls unstable:
/// one tick divides the stable stiffness by about three. Filter lightly, or not at all. After contact ends, the wrench
/// decays over a few 1/(2π f).
///
/// State: the last output. It is zero at the start and after a tick that sent zero, and stays at a reset of the scene,
/// so that no step comes of that. Haptic thread.
class FirstOrderFilter {
 public:
  static constexpr bool kUsesTwist = false;

  struct Options {
    double cutoff = 200;  ///< f, where the gain is 1/√2 [Hz], > 0

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      if (!(cutoff > 0) || !is_finite(cutoff)) refuse("FirstOrderFilter", "cutoff must be finite and > 0 Hz", cutoff);
    }
    /// Returns the delay of a slow signal [s].
    [[nodiscard]] double delay() const noexcept { return 1 / (2 * std::numbers::pi * cutoff); }
  };

  /// Throws std::invalid_argument if the cut-off is out of range.
  explicit FirstOrderFilter(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept, without a step in the output; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void forget_wrench() noexcept { state_ = Wrenchd::zero(); }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const double decay = std::exp(-2 * std::numbers::pi * options_.cutoff * context.dt);  // 1 − α
    filter(decay, wrench.force, state_.force);
    filter(decay, wrench.torque, state_.torque);
    wrench = state_;
  }

 private:
  /// [N, N·m] outputs below this end the decay, which would otherwise continue in slow denormal numbers.
  static constexpr double kNegligible = 1e-12;

  static void filter(double decay, const Vec3d& in, Vec3d& out) noexcept {
    for (int i = 0; i < 3; ++i) {
      out[i] = in[i] + decay * (out[i] - in[i]);
      if (in[i] == 0 && std::abs(out[i]) < kNegligible) out[i] = 0;
    }
  }

  Options options_;
  Wrenchd state_;
};

}  // namespace trephine
