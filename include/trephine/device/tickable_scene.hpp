// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>

#include <concepts>

namespace trephine {

/// What a servo loop and a replay ask of a scene: pose in, wrench about T in W axes out, bounded, without exceptions.
/// `dt` [s] is the time since the last tick. A scene may also declare `static constexpr bool kHasTorque` (whether it
/// computes torque), `double stiffness() const` (largest contact stiffness [N/m]) and, where that depends on how hard
/// the tool presses, `double tangent_stiffness(double force) const` [N/m at N]; the loop compares them with the device.
template <class S>
concept TickableScene = requires(S& scene, const TickInput& input, double dt) {
  { scene.tick(input, dt) }
  noexcept->std::same_as<TickResult>;
};

}  // namespace trephine
