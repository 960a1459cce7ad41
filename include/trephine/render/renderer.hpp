// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/tool/shape.hpp>

#include <concepts>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// A renderer computes the wrench of a tool in contact with bone. All quantities are in the grid's frame G, in metres,
/// so that accuracy does not depend on the grid's place in the world. `render` runs once a tick on the haptic thread.
/// The other members return results of the last `render`, for logging, drawing and carving.
///
/// A renderer whose law depends on time has `render(field, X_GT, dt)` too, with the time since the last tick [s].
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

}  // namespace trephine
