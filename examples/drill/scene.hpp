// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"

#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/stage/milling_vibration.hpp>

/// What is drilled here and with hardware alike: only renderer and device differ.
namespace drill {

/// Bone gives way at a rate, not at once: the hand feels it, and a burr that is fed too fast lags behind. The densest
/// voxels let the burr down by its radius in about 1.5 s. Not by force: Line's tip is a point, feels nothing once it
/// has fallen into a pit, and would leave the pit's walls standing.
[[nodiscard]] inline trephine::RateLimitedCut<> bite(const Bone& bone) {
  const double voxels = bone.burr.tip_radius / bone.grid.spacing().minCoeff();
  return {.rate = (bone.grid.original_range().max - bone.isovalue) * voxels / 1.5};
}

/// The scene. `bone` may be a copy of `about`'s grid; `limits` are the device's.
template <class Renderer>
[[nodiscard]] auto scene_of(Grid& bone, const Bone& about, const Renderer& renderer,
                            const trephine::DeviceLimits& limits) {
  using namespace trephine;
  return HapticScene{bone,
                     about.isovalue,
                     renderer,
                     Milling{bite(about)},
                     MillingVibration{{.frequency = 180, .per_force = 0.08}},
                     Damping{{.linear = 1, .angular = 1e-4, .only_in_contact = true}},
                     limits};
}

}  // namespace drill
