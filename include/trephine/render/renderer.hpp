// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/tool/shape.hpp>

#include <concepts>
#include <span>

namespace trephine {

/// What a scene asks of a renderer: contact of tool and bone in, wrench out. Everything is in the grid's frame G, in
/// metres, so that accuracy does not depend on where the grid stands in the world. `render` runs once a tick on the
/// haptic thread; the other members describe what the last `render` found and are for logging, drawing and carving.
/// One that can do with less where nobody asks for torque has `disable_torque()` too: a scene that lists ForceOnly
/// calls it as it is made.
// clang-format off
template <class R, class Field>
concept Renderer = requires(R r, const R& c, const Field& field, const Pose<typename R::Scalar>& X_GT) {
  typename R::Scalar;
  typename R::Gradient;  // policy: which gradient of the density
  { r.render(field, X_GT) } noexcept -> std::same_as<Rendered<typename R::Scalar>>;
  { r.reset() } noexcept;                                                 // forget all contact
  { c.proxy_pose() } noexcept -> std::same_as<Pose<typename R::Scalar>>;    // X_GP: the tool held on the surface
  { c.cutting_pose() } noexcept -> std::same_as<Pose<typename R::Scalar>>;  // where carving follows the burr
  { c.visual_pose() } noexcept -> std::same_as<Pose<typename R::Scalar>>;   // where to draw the tool
  { c.contacts() } noexcept -> std::same_as<std::span<const ContactPoint<typename R::Scalar>>>;
  { c.shape() } noexcept -> std::same_as<const Burr&>;
};
// clang-format on

}  // namespace trephine
