// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/field_archetype.hpp>
#include <trephine/contact/surface_proxy.hpp>

#include <algorithm>

/// Deep contact of the Surface approximation: the force of a group of vertices whose centre is in bone. There the sum
/// of the group's springs would cancel or reverse. Each group has its own state.
namespace trephine {

/// State of `HoldForce` (thesis Eq. 18, 19): holds the force of t−1. The held force does not rotate with the tool, does
/// not change when the tool moves on, and is zero if the session starts in bone.
template <RealScalar Scalar>
class HeldForceState {
 public:
  /// Stores the group's force [N] of a tick with its centre outside bone.
  void update_outside(const Vec3<Scalar>&, const Vec3<Scalar>& force) noexcept {
    held_force_ = force;
    has_force_ = true;
  }
  /// Returns the held force in `force`; `kStartedInside` without one.
  template <PointField Field>
  Status compute_inside(const Field&, const Vec3<Scalar>&, Scalar, Scalar, Vec3<Scalar>& force) noexcept {
    force = held_force_;
    return has_force_ ? Status::kOk : Status::kStartedInside;
  }
  void reset() noexcept {
    held_force_.setZero();
    has_force_ = false;
  }

 private:
  Vec3<Scalar> held_force_ = Vec3<Scalar>::Zero();
  bool has_force_ = false;
};

/// State of `ExtendAlongSurface` (ours): a frictionless SurfaceProxy follows the group's centre on the bone's surface,
/// and a spring extends the law beyond the centre. Its force is F = edge_force (1 + depth / R), toward the proxy. It
/// rotates with the surface, grows with depth, and works for a session that starts in bone.
///
/// Continuity at entry: the vertices' force equals edge_force only on a plane. Between walls the vertices' forces
/// oppose each other and give about half of it. A step by the other half would act as an infinitely stiff spring, on
/// which no device is stable. The state therefore subtracts the deficit at entry. It fades to zero over a depth of R/4,
/// or while the proxy moves on by R.
template <RealScalar Scalar>
class ExtensionState {
  // The deficit at entry vanishes at a depth of R over this.
  static constexpr auto kDeficitDepths = Scalar(4);
  // Largest gap between centre and surface at the tick before entry, as a fraction of R, from which the force at the
  // surface is extrapolated. From farther off the vertices' force does not predict it.
  static constexpr auto kMaxGap = Scalar(0.5);
  // Depth in voxels from which on the direction to the proxy replaces the surface normal, its limit at depth 0.
  static constexpr auto kMinDepth = Scalar(0.5);
  // Tangential moves of the proxy per tick. The centre moves little in a tick, and a late proxy catches up later.
  static constexpr int kProxyIterations = 8;

 public:
  /// Stores the group's centre c [m] and force [N] of a tick with the centre outside bone.
  void update_outside(const Vec3<Scalar>& c, const Vec3<Scalar>& force) noexcept {
    proxy_.place_free(c);
    outside_centre_ = c;
    outside_force_ = force;
    was_outside_ = true;
    was_inside_ = false;
  }

  /// Computes the force [N] of a tick with the group's centre c [m] in bone. `edge_force` [N] is the law's force on a
  /// plane with the centre on the surface; `radius` is the group's [m].
  template <PointField Field>
  Status compute_inside(const Field& field, const Vec3<Scalar>& c, Scalar radius, Scalar edge_force,
                        Vec3<Scalar>& force) noexcept {
    const Status status = proxy_.follow(field, c);
    force.setZero();
    if (!proxy_.in_contact()) {
      was_outside_ = was_inside_ = false;
      return status;
    }
    const Vec3<Scalar>& q = proxy_.position();
    if (was_inside_)
      deficit_ *= std::max(Scalar(0), Scalar(1) - (q - previous_proxy_).norm() / radius);
    else
      deficit_ = was_outside_ ? deficit_on_entry(radius, edge_force) : Scalar(0);
    was_inside_ = true;
    previous_proxy_ = q;
    const Vec3<Scalar> e = q - c;
    const Scalar depth = e.norm();
    const Vec3<Scalar> direction = depth > kMinDepth * field.voxel() ? Vec3<Scalar>(e / depth) : proxy_.normal();
    const Scalar deficit = deficit_ * std::max(Scalar(0), Scalar(1) - kDeficitDepths * depth / radius);
    force = (edge_force * (Scalar(1) + depth / radius) - deficit) * direction;
    return status;
  }
  void reset() noexcept {
    proxy_.reset();
    was_outside_ = was_inside_ = false;
  }

 private:
  // Deficit of the vertices' force against edge_force at the surface [N]. The force of the tick before entry is
  // extrapolated over the remaining gap by the law on a plane, which goes with the square of the depth.
  [[nodiscard]] Scalar deficit_on_entry(Scalar radius, Scalar edge_force) const noexcept {
    const Scalar gap = std::max(Scalar(0), (outside_centre_ - proxy_.position()).dot(proxy_.normal()));
    if (!(gap < radius * kMaxGap)) return Scalar(0);
    return edge_force - outside_force_.norm() * (Scalar(1) + Scalar(2) * gap / radius);
  }

  SurfaceProxy<Scalar> proxy_{ProxyOptions{.iterations = kProxyIterations, .trigger = Trigger::kThesis}};
  bool was_outside_ = false;                            // the last contact began from outside bone
  bool was_inside_ = false;                             // the centre was in bone in the previous tick
  Vec3<Scalar> outside_centre_ = Vec3<Scalar>::Zero();  // last centre outside bone
  Vec3<Scalar> outside_force_ = Vec3<Scalar>::Zero();   // the vertices' force then [N]
  Vec3<Scalar> previous_proxy_ = Vec3<Scalar>::Zero();  // the proxy in the previous tick
  Scalar deficit_ = Scalar(0);                          // of the force at the surface [N]
};

/// Deep contact of the thesis: holds the last force from outside bone.
struct HoldForce {
  template <RealScalar Scalar>
  using State = HeldForceState<Scalar>;
};
/// Deep contact that extends the force law along the surface: the default.
struct ExtendAlongSurface {
  template <RealScalar Scalar>
  using State = ExtensionState<Scalar>;
};

/// A policy for deep contact. `State<Scalar>` is default-constructed for each group; see `ExtensionState` for the
/// meaning of its functions' arguments.
// clang-format off
template <class D>
concept DeepContact = requires(typename D::template State<float> state, const detail::FieldArchetype<float>& field,
                               const Vec3<float>& c, float x, Vec3<float>& force) {
  requires std::default_initializable<typename D::template State<float>>;
  { state.update_outside(c, c) } noexcept;
  { state.compute_inside(field, c, x, x, force) } noexcept -> std::same_as<Status>;
  { state.reset() } noexcept;
};
// clang-format on

}  // namespace trephine
