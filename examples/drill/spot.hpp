// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"

#include <optional>

namespace drill {

/// Where the drill goes in.
struct Spot {
  trephine::Vec3d p_W;       ///< on the bone's surface [m]
  trephine::Vec3d normal_W;  ///< outward, of the surface over the width of the burr
  double depth = 0;          ///< bone below it, as far as looked [m]
  double unevenness = 0;     ///< farthest the surface round it lies from its plane [m]
};

/// A place for a hole: fairly flat, thick enough, and with room outside for the whole shaft, leaning too.
/// Deterministic. Throws std::runtime_error where the bone has none.
[[nodiscard]] Spot find_spot(const Bone& bone);

/// The surface nearest to a place in the world, and the way out there. Throws std::runtime_error where there is none
/// within 10 burr radii.
[[nodiscard]] Spot spot_near(const Bone& bone, const trephine::Vec3d& p_W);

}  // namespace drill
