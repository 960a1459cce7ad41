// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_proxy.hpp>

#include <algorithm>

namespace trephine::inline TREPHINE_ALIGNED {

/// Deep contact of the Surface approximation: the force of a group of vertices whose centre is in bone (thesis Eq. 18,
/// 19; ours). There the sum of the group's springs would cancel or reverse. Each group has its own state.
///
/// A frictionless SurfaceProxy q follows the group's centre c on the bone's surface, and springs toward it extend the
/// law beyond the centre. On a plane F = edge_force (1 + depth / R). The force rotates with the surface, grows with
/// depth, and works for a session that starts in bone.
///
/// Continuity: between walls and over edges the vertices' force is not edge_force along the normal. Up to a depth of
/// R/4 the state therefore blends from the vertices' law, evaluated with the group moved out to q, to the springs.
/// Where the centre enters or leaves bone q is at c, and the vertices' law goes on.
template <RealScalar Scalar>
class DeepContact {
  // The vertices' law fades to zero over a depth of R over this.
  static constexpr auto kBlendDepths = Scalar(4);
  // Distance in voxels at which a group's centre is moved beyond the surface: rays that end at the centre end outside
  // bone in spite of rounding.
  static constexpr auto kMargin = static_cast<Scalar>(2 * kSurfaceTolerance);
  // Tangential moves of the proxy per tick. The centre moves little in a tick, and a late proxy catches up later.
  static constexpr int kProxyIterations = 8;
  // Longest way of the proxy over the centre's: it drops off an edge so gradually. On a ball of bone of radius B it
  // follows up to a depth of B/2.
  static constexpr double kProxySlide = 2;

 public:
  /// Stores the group's centre c [m] of a tick with the centre outside bone.
  void update_outside(const Vec3<Scalar>& c) noexcept { proxy_.place_free(c); }

  /// Moves the proxy for the group's centre c [m] in bone. Returns in `shift` [m] how far the group is moved out for
  /// the vertices' law, or zero if that has faded.
  template <PointField Field>
  Status move_out(const Field& field, const Vec3<Scalar>& c, Scalar radius, Vec3<Scalar>& shift) noexcept {
    // Normals of single cells turn from cell to cell, and the proxy would snap between their ripples.
    const Status status = [&] {
      if constexpr (requires { field.smooth(); })
        return proxy_.follow(field.smooth(), c);
      else
        return proxy_.follow(field, c);
    }();
    to_proxy_.setZero();
    shift.setZero();
    if (!proxy_.in_contact()) return status;
    to_proxy_ = proxy_.position() - c;
    if (vertex_share(radius) > Scalar(0)) shift = to_proxy_ + kMargin * field.voxel() * proxy_.normal();
    return status;
  }

  /// Force [N] of a tick with the group's centre in bone, after `move_out`. `of_vertices` is the force of its vertices
  /// there. `edge_force` [N] is the law's force on a plane with the centre on the surface; `radius` is the group's [m].
  [[nodiscard]] Vec3<Scalar> force(Scalar radius, Scalar edge_force, const Vec3<Scalar>& of_vertices) const noexcept {
    const Scalar blended = std::max(to_proxy_.norm(), radius / kBlendDepths);
    return vertex_share(radius) * of_vertices + edge_force * (Scalar(1) / blended + Scalar(1) / radius) * to_proxy_;
  }
  /// Share of the vertices' force in this tick, 0 to 1.
  [[nodiscard]] Scalar vertex_share(Scalar radius) const noexcept {
    return std::max(Scalar(0), Scalar(1) - kBlendDepths * to_proxy_.norm() / radius);
  }
  void reset() noexcept { proxy_.reset(); }

 private:
  SurfaceProxy<Scalar> proxy_{ProxyOptions{.iterations = kProxyIterations, .slide = kProxySlide}};
  Vec3<Scalar> to_proxy_ = Vec3<Scalar>::Zero();  // from the centre [m]
};

}  // namespace trephine
