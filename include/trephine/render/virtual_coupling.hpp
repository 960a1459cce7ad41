// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/vertex_contacts.hpp>

#include <algorithm>
#include <span>

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

/// What Gauss–Newton leaves out, where it counts: over an edge the ball's centre goes round it, so that pressed with F
/// the energy's second derivative across is k_v − F/R, where `H` has k_v. Without it a search is late by ticks. `pull`
/// [m] is the coupling's; from three quarters of `radius` on it counts as that, as with the device beyond the edge the
/// ball falls off.
template <class MatN>
void subtract_rolling(std::span<const VertexContact> found, double contact_stiffness, double radius, double stiffness,
                      double pull, MatN& H) noexcept {
  double sum = 0;
  for (const VertexContact& c : found) sum += c.rolls[0].isZero(0) ? 0 : contact_stiffness * c.depth;
  if (!(sum > 0)) return;
  const double most = stiffness * std::min(0.75 * radius, pull);
  const double share = std::min(1.0, most / sum) * contact_stiffness / radius;
  for (const VertexContact& c : found)
    for (const Vec3d& way : c.rolls) H.template topLeftCorner<3, 3>() -= (share * c.depth) * way * way.transpose();
}

}  // namespace trephine
