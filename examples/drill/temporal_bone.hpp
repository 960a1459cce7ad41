// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "structures.hpp"

#include <trephine/core/math.hpp>

/// A made-up temporal bone whose structures are formulas: what labels, guard and veto do is judged by exact distances.
/// Sizes are an adult's, places are plausible and no anatomy. W: z outward from the bone's flat outer face at z = 0, x
/// forward, y up.
namespace drill::temporal_bone {

/// Structures in the order of their labels.
enum Structure : int { kFacialNerve, kChorda, kCanals, kCochlea, kSinus, kDura, kCarotid, kCount };

/// A place on the outer face over the facial nerve [m].
inline const trephine::Vec3d kSpot_W(0, -2e-3, 0);

/// Signed distance [m] from a structure at p_W: exact outside of it, and inside where it is one tube or plate.
[[nodiscard]] double distance(int structure, const trephine::Vec3d& p_W);

/// The bone, in voxels of 0.4 mm [HU]: solid but for air cells and for the structures, which hold soft tissue.
[[nodiscard]] Bone bone(const Options& options);

/// Labels of the structures, in voxels of 0.3 mm askew to the bone's.
[[nodiscard]] StructureLabels labels();

/// The labels, and a way to each structure that passes by the others.
/// Throws std::runtime_error where a burr of this size has no such way.
[[nodiscard]] MadeStructures structures(const trephine::Burr& burr);

}  // namespace drill::temporal_bone
