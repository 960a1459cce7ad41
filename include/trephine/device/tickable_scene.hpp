// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/status.hpp>
#include <trephine/core/tick.hpp>

#include <concepts>

namespace trephine::inline TREPHINE_ALIGNED {

/// A scene as servo loops and replays use it: `tick` takes a pose and returns the wrench about T in W axes, in bounded
/// time and without exceptions. `dt` [s] is the time since the last tick. Optional members, which the loop compares
/// with the device:
/// - `static constexpr bool kHasTorque` is true if the scene computes torque.
/// - `double stiffness() const` returns the largest contact stiffness [N/m].
/// - `double tangent_stiffness(double force) const` returns it at a contact force [N], if it depends on the force.
/// - `bool bounds_wrench() const noexcept` is true if the scene's wrench never steps but to zero, so that a jump needs
///   no ramp.
/// - `std::vector<std::string> warnings() const` returns sentences that the loop's own warnings begin with.
template <class S>
concept TickableScene = requires(S& scene, const TickInput& input, double dt) {
  { scene.tick(input, dt) } noexcept -> std::same_as<TickResult>;
};

/// Returns true if the wrench on the hand must rise from zero after this tick. A scene that bounds its wrench needs
/// that only where it sent none.
template <TickableScene Scene>
[[nodiscard]] bool needs_ramp(const Scene& scene, const TickResult& result) noexcept {
  if constexpr (requires { scene.bounds_wrench(); })
    if (scene.bounds_wrench()) return result.status >= Status::kBadInput;
  return needs_ramp(result.status);
}

}  // namespace trephine
