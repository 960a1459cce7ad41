// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/tool/shape.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// A renderer computes the wrench of a tool in contact with bone. All quantities are in the grid's frame G, in metres,
/// so that accuracy does not depend on the grid's place in the world. `render` runs once a tick on the haptic thread.
/// The other members return results of the last `render`, for logging, drawing and carving.
///
/// What a renderer may have besides stands in stage/members.hpp.
// clang-format off
template <class R, class Field>
concept Renderer = requires(R r, const R& c, const Field& field, const Pose<typename R::Scalar>& X_GT) {
  typename R::Scalar;
  typename R::Gradient;  // policy for the density's gradient
  { r.render(field, X_GT) } noexcept -> std::same_as<Rendered<typename R::Scalar>>;
  { r.reset() } noexcept;                                                 // clears all contact
  { c.proxy_pose() } noexcept -> std::same_as<Pose<typename R::Scalar>>;    // X_GP: the tool on the surface
  { c.cutting_pose() } noexcept -> std::same_as<Pose<typename R::Scalar>>;  // pose at which the burr cuts
  { c.visual_pose() } noexcept -> std::same_as<Pose<typename R::Scalar>>;   // pose at which to draw the tool
  { c.contacts() } noexcept -> std::same_as<std::span<const ContactPoint<typename R::Scalar>>>;
  { c.shape() } noexcept -> std::same_as<const Burr&>;
};
// clang-format on

/// Writes contact points of G in the world, as many as `out` holds; returns their number.
template <RealScalar Scalar>
std::size_t write_contacts(std::span<const ContactPoint<Scalar>> contacts, const Posed& X_WG,
                           std::span<ContactPoint<double>> out) noexcept {
  const std::size_t count = std::min(contacts.size(), out.size());
  const Mat3d R_WG = X_WG.linear();
  const Vec3d p_WG = X_WG.translation();
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d p = contacts[i].position.template cast<double>(), n = contacts[i].normal.template cast<double>(),
                f = contacts[i].force.template cast<double>();
    out[i] = {.position = product(R_WG, p) + p_WG, .normal = product(R_WG, n), .force = product(R_WG, f)};
  }
  return count;
}

}  // namespace trephine
