// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/release_bound.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// Keeps force and torque from stepping where bone gives way, an edge is passed or contact starts anew, for Line. The
/// coupled tool's scene has this bound within (`CoupledOptions::release`).
///
/// The wrench counts as that of two springs of the given stiffnesses, for translation and rotation (`ReleaseBound`). A
/// wrench that the tool's own motion in the bone's frame explains passes unchanged, to the bit. While the limit acts on
/// a falling wrench, the springs' energy is lost and none is given to the hand. `WrenchRateLimit` counts no motion, and
/// lags behind a stiff wall.
///
/// List this stage first, before damping and other parts that change the wrench. State: the last wrench. Haptic thread.
class ReleaseLimit {
 public:
  struct Options {
    /// k [N/m]: no less than the contact's tangent stiffness. With less, the limit would give back more energy than the
    /// contact took. For Line it is twice `LineOptions::stiffness`, as tip and shaft add up. Surface's stiffness grows
    /// with depth and contact, so the limit does not suit it.
    double stiffness = 1600;
    double rotational_stiffness = 0.3;  ///< k_θ, what counts as one: it weighs torque against force [N·m/rad]
    double release = 60;                ///< fastest change of the force besides k times the tool's motion [N/s]

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      const auto check_gain = [](const char* rule, double v) {
        if (!(v > 0) || !is_finite(v)) refuse("ReleaseLimit", rule, v);
      };
      check_gain("stiffness must be finite and > 0 N/m", stiffness);
      check_gain("rotational_stiffness must be finite and > 0 N·m/rad", rotational_stiffness);
      check_gain("release must be finite and > 0 N/s", release);
    }
  };

  /// Throws std::invalid_argument if an option is out of range.
  explicit ReleaseLimit(const Options& options = default_options()) {
    options.validate();
    adopt(options);
  }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept; between ticks, haptic thread.
  void adopt(const Options& options) noexcept {
    options_ = options;
    bound_.set(options.stiffness, std::sqrt(options.rotational_stiffness / options.stiffness), options.release);
  }
  [[nodiscard]] bool bounds_wrench() const noexcept { return true; }

  void forget_wrench() noexcept { bound_.reset(); }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const Twist& v = context.twist_to_bone;
    bound_.follow(context.input.X_WT, context.status >= Status::kJump);
    bound_.apply(wrench, spatial(context.dt * v.linear, context.dt * v.angular), context.dt);
  }

 private:
  [[nodiscard]] static Options default_options() noexcept { return {}; }

  Options options_;
  ReleaseBound bound_;
};

}  // namespace trephine
