// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_proxy.hpp>

namespace trephine {

/// What a group of the Surface approximation gives once its own centre is in bone, where the sum of its springs would
/// cancel or turn. A policy object exists per group.

/// Thesis, Eq. 18, 19: the force of t−1, held. It does not turn with the tool, is zero when the run starts in bone and
/// stays when the tool is dragged along.
template <RealScalar Scalar>
class HeldForce {
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
/// along the way out: F = (edge_force + edge_force / R · depth) toward that point. Turns with the surface, grows with
/// depth, starts where the vertex law ends, and works when the run starts in bone.
template <RealScalar Scalar>
class SurfaceExtension {
 public:
  void outside(const Vec3<Scalar>& c, const Vec3<Scalar>&) noexcept { proxy_.stand_free_at(c); }

  template <PointField Field>
  Status inside(const Field& field, const Vec3<Scalar>& c, Scalar radius, Scalar edge_force,
                Vec3<Scalar>& force) noexcept {
    const Status status = proxy_.follow(field, c);
    force.setZero();
    if (!proxy_.in_contact()) return status;
    const Vec3<Scalar> e = proxy_.position() - c;
    const Scalar depth = e.norm();
    // Right at the surface e has no direction yet; the normal there is its limit.
    const Vec3<Scalar> out = depth > Scalar(0.5) * field.voxel() ? Vec3<Scalar>(e / depth) : proxy_.normal();
    force = (edge_force * (Scalar(1) + depth / radius)) * out;
    return status;
  }
  void reset() noexcept { proxy_.reset(); }

 private:
  SurfaceProxy<Scalar> proxy_{ProxyOptions{.iterations = 8, .trigger = Trigger::kThesis}};
};

/// Policies by name: what a renderer keeps per group.
struct HoldForce {
  template <RealScalar Scalar>
  using State = HeldForce<Scalar>;
};
struct ExtendAlongSurface {
  template <RealScalar Scalar>
  using State = SurfaceExtension<Scalar>;
};

template <class D>
concept DeepContact = std::same_as<D, HoldForce> || std::same_as<D, ExtendAlongSurface>;

}  // namespace trephine
