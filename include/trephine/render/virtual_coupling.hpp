// SPDX-License-Identifier: MIT
#pragma once

namespace trephine {

/// A spring between the device's pose and the virtual tool's, translation and rotation apart (Colgate 1995; Wan and
/// McNeely 2003), that pulls with at most `force` and `torque`: quadratic in the distance up to there, linear beyond,
/// so that what the hand feels is within the device's limits at once and still the gradient of an energy.
struct CouplingSpring {
  double stiffness;             ///< k_v [N/m]
  double rotational_stiffness;  ///< k_θ [N·m/rad]
  double force;                 ///< most [N]
  double torque;                ///< most [N·m]

  /// Secant stiffness at this distance: what times it is the pull.
  [[nodiscard]] static double secant(double k, double most, double distance) noexcept {
    return k * distance > most ? most / distance : k;
  }
  [[nodiscard]] static double energy(double k, double most, double distance) noexcept {
    const double bend = most / k;
    return distance <= bend ? 0.5 * k * distance * distance : most * (distance - 0.5 * bend);
  }
  [[nodiscard]] double linear(double distance) const noexcept { return secant(stiffness, force, distance); }
  [[nodiscard]] double angular(double angle) const noexcept { return secant(rotational_stiffness, torque, angle); }
  /// Of a pull over `step` [m] and `turn` [rad].
  [[nodiscard]] double energy(double step, double turn) const noexcept {
    return energy(stiffness, force, step) + energy(rotational_stiffness, torque, turn);
  }
};

}  // namespace trephine
