// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <algorithm>

namespace trephine::inline TREPHINE_ALIGNED {

/// A spindle's motor, whose torque falls in a straight line from stall to the free speed. Air turbines do so closely
/// (Dyson and Darvell, J Dent 1999, 27:573). Electric motors under a speed controller hold their speed longer, so the
/// line is the motor alone. Torque and inertia are those at the tool, behind any gear.
struct Motor {
  double speed;         ///< without load [rad/s]
  double stall_torque;  ///< at which it stands [N·m]
  double inertia;       ///< of rotor and spindle, without the tool [kg m²]

  /// Steady speed [rad/s] under a torque [N·m]; 0 from the stall torque on.
  [[nodiscard]] constexpr double speed_under(double torque) const noexcept {
    return speed * std::clamp(1 - torque / stall_torque, 0.0, 1.0);
  }
  /// Power at the tool [W] under a torque [N·m]: largest, stall torque times speed / 4, at half the free speed.
  [[nodiscard]] constexpr double power_under(double torque) const noexcept { return torque * speed_under(torque); }
};

}  // namespace trephine
