// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/vertex_contacts.hpp>

#include <algorithm>
#include <span>

namespace trephine {

/// What Gauss–Newton leaves out, where it counts: over an edge the ball's centre goes round it, so that pressed with F
/// the energy's second derivative across is k_v − F/R, where `H` has k_v; less where bone is round. Without it a search
/// is late by ticks. `pull` [m] is the coupling's; from three quarters of `radius` on it counts as that, as with the
/// device beyond the edge the ball falls off.
template <class MatN>
void subtract_rolling(std::span<const VertexContact> found, double contact_stiffness, double radius, double stiffness,
                      double pull, MatN& H) noexcept {
  double sum = 0;
  for (const VertexContact& c : found) sum += c.rolls[0].isZero(0) ? 0 : contact_stiffness * c.weight * c.depth;
  if (!(sum > 0)) return;
  const double most = stiffness * std::min(0.75 * radius, pull);
  const double share = std::min(1.0, most / sum) * contact_stiffness / radius;
  for (const VertexContact& c : found)
    for (const Vec3d& way : c.rolls)
      H.template topLeftCorner<3, 3>() -= (share * c.weight * c.depth) * way * way.transpose();
}

}  // namespace trephine
