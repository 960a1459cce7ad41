// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/release_limit.hpp>

/// What is drilled here and with hardware alike: only renderer and device differ.
namespace drill {

/// The surface recedes at a speed, not at once: the hand feels bone, and a burr that is fed too fast lags behind. At
/// full cover the burr goes down by its radius in 0.2 s, whatever the bone's density and the voxels' size. Force plays
/// no part: Line's tip is a point, feels nothing in a pit, and would leave the pit's walls uncut.
[[nodiscard]] inline trephine::AdvancingCut bite(double radius) { return {.speed = radius / 0.2}; }
[[nodiscard]] inline trephine::AdvancingCut bite(const Bone& bone) { return bite(bone.burr.tip_radius); }

/// Line's tip is a point, and drops off an edge at once: a slope for the hand instead. `stiffness` is Line's option;
/// tip and shaft add up.
[[nodiscard]] inline trephine::ReleaseLimit line_release(double stiffness) {
  return trephine::ReleaseLimit{{.stiffness = 2 * stiffness}};
}

/// The scene, with a cut and more stages after it. `bone` may be a copy of `about`'s grid; `limits` are the device's.
template <class Renderer, class Cut, class... More>
[[nodiscard]] auto scene_with(Grid& bone, const Bone& about, const Renderer& renderer,
                              const trephine::DeviceLimits& limits, const Cut& cut, const More&... more) {
  using namespace trephine;
  return HapticScene{bone,
                     about.isovalue,
                     renderer,
                     Cutting{cut},
                     more...,
                     MillingVibration{{.frequency = 180, .per_force = 0.08}},
                     Damping{{.linear = 1, .angular = 1e-4, .only_in_contact = true}},
                     limits};
}
template <class Renderer, class... More>
[[nodiscard]] auto scene_of(Grid& bone, const Bone& about, const Renderer& renderer,
                            const trephine::DeviceLimits& limits, const More&... more) {
  return scene_with(bone, about, renderer, limits, bite(about), more...);
}

}  // namespace drill
