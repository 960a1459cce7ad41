// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>

#include <concepts>

namespace trephine {

/// A scene as servo loops and replays use it: `tick` takes a pose and returns the wrench about T in W axes, in bounded
/// time and without exceptions. `dt` [s] is the time since the last tick. Optional members, which the loop compares
/// with the device:
/// - `static constexpr bool kHasTorque` is true if the scene computes torque.
/// - `double stiffness() const` returns the largest contact stiffness [N/m].
/// - `double tangent_stiffness(double force) const` returns it at a contact force [N], if it depends on the force.
template <class S>
concept TickableScene = requires(S& scene, const TickInput& input, double dt) {
  { scene.tick(input, dt) }
  noexcept->std::same_as<TickResult>;
};

}  // namespace trephine
