// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/release_bound.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/motion.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace trephine {

/// Limits how fast force and torque fall where bone gives way or an edge is passed, for Line. The coupled tool has this
/// limit within (`CoupledOptions::release`).
///
/// The wrench counts as that of two springs of the given stiffnesses, for translation and rotation (`ReleaseBound`). A
/// wrench that the tool's own motion in the bone's frame explains, or that rises, passes unchanged, to the bit. While
/// the limit acts, the springs' energy is lost and none is given to the hand. `WrenchRateLimit` limits rises too, and
/// lags behind a stiff wall.
///
/// List this stage first, before damping and other parts that change the wrench. State: the last wrench and pose.
/// Haptic thread.
class ReleaseLimit {
 public:
  static constexpr bool kUsesTwist = false;

  struct Options {
    /// k [N/m]: no less than the contact's tangent stiffness. With less, the limit would give back more energy than the
    /// contact took. For Line it is twice `LineOptions::stiffness`, as tip and shaft add up. Surface's stiffness grows
    /// with depth and contact, so the limit does not suit it.
    double stiffness = 1600;
    double rotational_stiffness = 0.3;  ///< k_θ, what counts as one: it weighs torque against force [N·m/rad]
    double release = 60;                ///< fastest fall of the force besides k times the device's motion [N/s]

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      const auto check = [](const char* rule, double v) {
        if (!(v > 0) || !std::isfinite(v)) refuse("ReleaseLimit", rule, v);
      };
      check("stiffness must be finite and > 0 N/m", stiffness);
      check("rotational_stiffness must be finite and > 0 N·m/rad", rotational_stiffness);
      check("release must be finite and > 0 N/s", release);
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
    constexpr double kNone = std::numeric_limits<double>::infinity();
    options_ = options;
    bound_ = {options.release / options.stiffness, std::sqrt(options.rotational_stiffness / options.stiffness), kNone,
              kNone};
  }

  void reset() noexcept { bound_.reset(); }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (needs_ramp(context.status)) reset();
    const Posed before = std::exchange(X_GT_, relative_pose(context.X_WG, context.input.X_WT));
    const Wrenchd in_grid = wrench.rotated(inverse_rotation(context.X_WG));
    Vec6d extension = spatial(in_grid.force / -options_.stiffness, in_grid.torque / -options_.rotational_stiffness);
    if (!bound_.apply(extension, before, X_GT_, context.dt)) return;
    const Wrenchd held{-options_.stiffness * linear_part(extension),
                       -options_.rotational_stiffness * angular_part(extension)};
    wrench = held.rotated(context.X_WG.linear());
  }

 private:
  [[nodiscard]] static Options default_options() noexcept { return {}; }

  Options options_;
  ReleaseBound bound_;
  Posed X_GT_ = Posed::Identity();  // of the last tick
};

}  // namespace trephine
