// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "surgeon.hpp"

#include <trephine/structure/label_grid.hpp>

#include <array>
#include <cstdint>

namespace drill {

using StructureLabels = trephine::LabelGrid<std::uint8_t>;

/// A straight way of the drill onto a structure.
struct Approach {
  trephine::Vec3d entry_W;  ///< on the bone's surface [m]
  double depth;             ///< of the structure below it, along the drill [m]
};

/// Made structures around the spot. No scan here has a segmentation, so thresholds and geometry stand for one.
struct MadeStructures {
  static constexpr int kNerve = 0, kSinus = 1, kDura = 2, kCount = 3;

  StructureLabels labels;                   ///< finer voxels than the bone's, and askew to them
  std::array<Approach, kCount> approaches;  /// by structure
};

/// Makes the structures; lengths go by the burr's radius:
/// - a nerve, a tube in the bone that crosses the drill's way;
/// - a sinus, a ball in the bone beside it, for a vein;
/// - the dura, a layer under the bone's far side: voxels without bone, reached by flooding from below the spot.
/// All ways lie in the plane of the surgeon's lean and outward directions. Throws std::runtime_error where the bone has
/// no surface beside the spot or no far side below it.
[[nodiscard]] MadeStructures make_structures(const Bone& bone, const Surgeon& surgeon);

}  // namespace drill
