// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/vertex_contacts.hpp>

#include <algorithm>
#include <span>

namespace trephine {

/// What Gauss–Newton leaves out, where it counts: how the depths that hold a ball bend, which adds their springs'
/// forces times ∂²φ/∂way² to E's second derivative. In a hollow of radius ρ, pressed with F, that is F/(ρ − R) beside
/// the k_v in `H`: without it steps go too far, to and fro. Over an edge the ball's centre goes round it, and it is
/// −F/R, less where bone is round: without it a search is late by ticks. Forces that lessen `H` are together at most
/// the coupling's at a `pull` [m], from three quarters of `radius` on as much as there: with the device beyond the edge
/// the ball falls off.
template <class MatN>
void add_rolling(std::span<const VertexContact> found, double contact_stiffness, double radius, double stiffness,
                 double pull, MatN& H) noexcept {
  double sum = 0;
  for (const VertexContact& c : found) sum += c.rolls[0].bend < 0 ? contact_stiffness * c.weight * c.depth : 0;
  const double most = stiffness * std::min(0.75 * radius, pull);
  const double share = sum > most ? most / sum : 1;
  for (const VertexContact& c : found)
    for (const Rolling<double>& roll : c.rolls) {
      const double force = (roll.bend < 0 ? share : 1) * contact_stiffness * c.weight * c.depth;
      H.template topLeftCorner<3, 3>() += (force * roll.bend) * roll.way * roll.way.transpose();
    }
}

}  // namespace trephine
