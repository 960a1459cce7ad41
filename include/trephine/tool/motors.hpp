// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/units.hpp>

#include <algorithm>
#include <array>
#include <numbers>
#include <string>
#include <string_view>

/// Motors of spindles by name.
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

/// Inertia about its axis [kg m²] of a solid steel cylinder (7800 kg/m³), π/2 ρ l r⁴, as which a rotor is estimated.
[[nodiscard]] constexpr double rotor_inertia(double radius, double length) noexcept {
  return std::numbers::pi / 2 * 7800 * length * radius * radius * radius * radius;
}

struct NamedMotor {
  std::string_view name;
  Motor motor;
};

/// The motors. The air turbine has the largest free speed and stall torque among 41 handpieces (Brockhurst and Shams,
/// Aust Dent J 1994, 39:33); their line's largest power is 3 % over the largest measured, 29.6 W, so it is the
/// strongest. A handpiece of 322 krpm slowed by 10.5 % at most when a coarse diamond cut leucite ceramic, with 0.24 to
/// 1.77 N along its way ("In-process assessment of the dental cutting of a leucite-reinforced glass-ceramic"). This
/// line falls by 5 to 38 % under those, at a radius of 0.5 mm, which is not stated there.
///
/// The other two are estimates for their class, not measurements: an electric dental motor of 40 000 rpm and 30 N·mm
/// behind a gear of 1:5, and a surgical drill of 80 000 rpm with a power of 84 W.
///
/// All inertias are estimates: a turbine's wheel of 8 by 3 mm; rotors of 10 by 30 mm, a gear of 1:5 taking 5² off.
inline constexpr std::array<NamedMotor, 3> kMotors{{
    {"air-turbine", {rpm(500'000), 2.33e-3, rotor_inertia(4e-3, 3e-3)}},
    {"electric-handpiece", {rpm(200'000), 6e-3, rotor_inertia(5e-3, 30e-3) / 25}},
    {"surgical-drill", {rpm(80'000), 40e-3, rotor_inertia(5e-3, 30e-3)}},
}};

/// Returns the motor of this name. Throws std::invalid_argument, with all names, for another.
[[nodiscard]] inline Motor motor_by_name(std::string_view name) {
  std::string rule = "the name must be one of";
  for (const NamedMotor& known : kMotors) {
    if (known.name == name) return known.motor;
    rule += (&known == kMotors.data() ? " " : ", ") + std::string(known.name);
  }
  refuse("motor_by_name", rule, name);
}

}  // namespace trephine
