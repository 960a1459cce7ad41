// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_proxy.hpp>

#include <algorithm>

namespace trephine {

/// What a group of the Surface approximation gives once its own centre is in bone, where the sum of its springs would
/// cancel or turn. A policy object exists per group.

/// Thesis, Eq. 18, 19: the force of t−1, held. It does not turn with the tool, is zero when the run starts in bone and
/// stays when the tool is dragged along.
template <RealScalar Scalar>
class HeldForceState {
 public:
  /// A tick with the centre outside; `force` is the group's.
  void outside(const Vec3<Scalar>&, const Vec3<Scalar>& force) noexcept {
    held_ = force;
    known_ = true;
  }
  /// A tick with the centre at `c` in bone. `edge_force` is the law's force with the centre on the surface [N].
  template <PointField Field>
  Status inside(const Field&, const Vec3<Scalar>&, Scalar, Scalar, Vec3<Scalar>& force) noexcept {
    force = held_;
    return known_ ? Status::kOk : Status::kStartedInside;
  }
  void reset() noexcept {
    held_.setZero();
    known_ = false;
  }

 private:
  Vec3<Scalar> held_ = Vec3<Scalar>::Zero();
  bool known_ = false;
};

/// Ours: a point on the surface follows the centre (a SurfaceProxy without friction), and the law goes on as a spring
/// along the way out: F = edge_force + edge_force / R · depth toward that point. Turns with the surface, grows with
/// depth, and works when the run starts in bone.
///
/// It starts where the vertex law ends. That is edge_force on a plane alone: where walls meet the vertices pull against
/// each other and give half of it, and a force that stepped up by the other half would be a spring without bounds, on
/// which no device rests. What the vertices were short of edge_force by is lacking at first, and comes as the centre
/// goes in by a quarter of R or the point moves on by R.
template <RealScalar Scalar>
class ExtensionState {
 public:
  void outside(const Vec3<Scalar>& c, const Vec3<Scalar>& force) noexcept {
    proxy_.place_free(c);
    before_ = c;
    force_before_ = force;
    came_from_outside_ = true;
    inside_ = false;
  }

  template <PointField Field>
  Status inside(const Field& field, const Vec3<Scalar>& c, Scalar radius, Scalar edge_force,
                Vec3<Scalar>& force) noexcept {
    const Status status = proxy_.follow(field, c);
    force.setZero();
    if (!proxy_.in_contact()) {
      came_from_outside_ = inside_ = false;
      return status;
    }
    const Vec3<Scalar>& q = proxy_.position();
    if (inside_)
      deficit_ *= std::max(Scalar(0), Scalar(1) - (q - at_).norm() / radius);
    else
      deficit_ = came_from_outside_ ? deficit_on_entry(radius, edge_force) : Scalar(0);
    inside_ = true;
    at_ = q;
    const Vec3<Scalar> e = q - c;
    const Scalar depth = e.norm();
    // Right at the surface e has no direction yet; the normal there is its limit.
    const Vec3<Scalar> out = depth > Scalar(0.5) * field.voxel() ? Vec3<Scalar>(e / depth) : proxy_.normal();
    const Scalar lacking = deficit_ * std::max(Scalar(0), Scalar(1) - Scalar(4) * depth / radius);
    force = (edge_force * (Scalar(1) + depth / radius) - lacking) * out;
    return status;
  }
  void reset() noexcept {
    proxy_.reset();
    came_from_outside_ = inside_ = false;
  }

 private:
  // Over what the centre was short of the surface in the tick before the law would have grown as on a plane, where it
  // goes with the square of the depth. From farther off it tells nothing.
  [[nodiscard]] Scalar deficit_on_entry(Scalar radius, Scalar edge_force) const noexcept {
    const Scalar short_by = std::max(Scalar(0), (before_ - proxy_.position()).dot(proxy_.normal()));
    if (!(short_by < radius / Scalar(2))) return Scalar(0);
    return edge_force - force_before_.norm() * (Scalar(1) + Scalar(2) * short_by / radius);
  }

  SurfaceProxy<Scalar> proxy_{ProxyOptions{.iterations = 8, .trigger = Trigger::kThesis}};
  bool came_from_outside_ = false;                    // from outside
  bool inside_ = false;                               // in the tick before
  Vec3<Scalar> before_ = Vec3<Scalar>::Zero();        // the centre, when it was outside
  Vec3<Scalar> force_before_ = Vec3<Scalar>::Zero();  // the vertices' then [N]
  Vec3<Scalar> at_ = Vec3<Scalar>::Zero();            // the point, in the tick before
  Scalar deficit_ = Scalar(0);                        // of edge_force, at the surface [N]
};

/// Policies by name: what a renderer keeps per group.
struct HoldForce {
  template <RealScalar Scalar>
  using State = HeldForceState<Scalar>;
};
struct ExtendAlongSurface {
  template <RealScalar Scalar>
  using State = ExtensionState<Scalar>;
};

template <class D>
concept DeepContact = std::same_as<D, HoldForce> || std::same_as<D, ExtendAlongSurface>;

}  // namespace trephine
