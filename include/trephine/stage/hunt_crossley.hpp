// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>

namespace trephine::inline TREPHINE_ALIGNED {

/// Impact damping after Hunt and Crossley: multiplies the contact wrench by (1 + λ ẋ), ẋ the rate of penetration [m/s].
/// Struck bone feels harder and dissipates energy. The damping scales with the force, so it has no step when contact
/// starts or ends. (Hunt and Crossley 1975, F = k x^n + λ_HC x^n ẋ. Our λ is their λ_HC/k, about 1.5 (1 − e)/v for a
/// restitution e at an impact speed v.) List it before stages that add forces, because it scales the whole wrench.
///
/// The rate is ẋ = −(f·v + τ·ω) / |f|, with v and ω relative to the bone. For one contact point, at any position, this
/// is exactly the point's speed into the bone along f; for several it is their mean weighted by force. If forces cancel
/// to a couple (a shaft held in a hole), |τ|/`lever` replaces the smaller |f|, so ẋ is the speed of a point at that
/// distance. The rate is exact for every single contact nearer to T than `lever`.
///
/// Force and torque are scaled by the same factor, so the force's line of action does not move. The factor is clamped
/// to [0, max_factor]: it never pulls, and a fast blow is bounded. A moving bone can push the tool.
///
/// No state. Haptic thread. A zero wrench stays zero.
class HuntCrossley {
 public:
  struct Options {
    double lambda = 1.0;      ///< λ [s/m], >= 0: 1 adds 10 % at 0.1 m/s
    double max_factor = 2.0;  ///< largest factor on the wrench, >= 1
    double lever = 0.040;     ///< longest lever arm of a contact [m], > 0: the shaft's length

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      if (!(lambda >= 0) || !is_finite(lambda)) refuse("HuntCrossley", "lambda must be finite and >= 0 s/m", lambda);
      if (!(max_factor >= 1) || !is_finite(max_factor))
        refuse("HuntCrossley", "max_factor must be finite and >= 1", max_factor);
      if (!(lever > 0) || !is_finite(lever)) refuse("HuntCrossley", "lever must be finite and > 0 m", lever);
    }
  };

  /// Throws std::invalid_argument if an option is out of range.
  explicit HuntCrossley(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void apply(const TickContext& context, Wrenchd& wrench) const noexcept {
    const double magnitude = std::max(wrench.force.norm(), wrench.torque.norm() / options_.lever);
    if (!(magnitude > 0)) return;
    const Twist& v = context.twist_to_bone;
    const double rate = -(wrench.force.dot(v.linear) + wrench.torque.dot(v.angular)) / magnitude;
    wrench *= std::clamp(1.0 + options_.lambda * rate, 0.0, options_.max_factor);
  }

 private:
  Options options_;
};

}  // namespace trephine
