// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Viscous damping: adds the force −b v and the torque −b_r ω to the wrench.
///
/// By default v and ω are the tool's velocity in the world, as if hand and tool moved in oil. With `only_in_contact`
/// they are relative to the bone, which may move, and act only while the renderer reports contact. The force then steps
/// by b v when contact starts and ends; `HuntCrossley` has no such step.
///
/// Stability: the velocity is a backward difference, half a tick late, and the force is held for a tick. On a free mass
/// m the loop is stable only for b < 2 m/dt (90 N·s/m for 45 g at 1 kHz), and likewise b_r < 2 I/dt. Stay at a tenth of
/// the bound. The loop is never passive by itself: the device needs friction or damping of its own (Colgate and
/// Schenkel 1997: b_device > K dt/2 + b). Encoder noise is amplified by b/dt.
///
/// No state. Haptic thread. Cost: a few multiplications, and the twists that the scene computes.
class Damping {
 public:
  struct Options {
    double linear = 0;             ///< b [N·s/m], >= 0
    double angular = 0;            ///< b_r [N·m·s/rad], >= 0
    bool only_in_contact = false;  ///< damp the motion relative to the bone, during contact only

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      if (!(linear >= 0) || !is_finite(linear)) refuse("Damping", "linear must be finite and >= 0 N·s/m", linear);
      if (!(angular >= 0) || !is_finite(angular))
        refuse("Damping", "angular must be finite and >= 0 N·m·s/rad", angular);
    }
  };

  /// Throws std::invalid_argument if an option is out of range.
  explicit Damping(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void apply(const TickContext& context, Wrenchd& wrench) const noexcept {
    if (options_.only_in_contact && context.contact.count == 0) return;
    const Twist& v = options_.only_in_contact ? context.twist_to_bone : context.twist;
    wrench.force -= options_.linear * v.linear;
    wrench.torque -= options_.angular * v.angular;
  }

 private:
  Options options_;
};

}  // namespace trephine
