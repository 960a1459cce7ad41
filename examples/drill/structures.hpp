// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "surgeon.hpp"

#include <trephine/structure/label_grid.hpp>

#include <cstdint>
#include <functional>
#include <vector>

namespace drill {

using StructureLabels = trephine::LabelGrid<std::uint8_t>;

/// A straight way of the drill onto a structure.
struct Approach {
  trephine::Vec3d entry_W;  ///< on the bone's surface [m]
  double depth;             ///< of the structure below it, along the drill [m]
};

/// Made structures. No scan here has a segmentation, so thresholds and geometry stand for one.
struct MadeStructures {
  StructureLabels labels;            ///< finer voxels than the bone's, and askew to them
  std::vector<Approach> approaches;  ///< by structure
  trephine::Mat3d frame_W;           ///< the drill's attitude on all ways: its shaft lies along the third column
  int shown = 0;                     ///< the structure on whose way pictures show the drill
  std::function<double(int structure, const trephine::Vec3d& p_W)> truth{};  ///< signed distance [m], if it is known
  [[nodiscard]] int count() const noexcept { return static_cast<int>(approaches.size()); }
};

/// The structures that are made around a spot of any bone, in the order of their labels.
enum SpotStructure : int { kNerve, kSinus, kDura, kSpotStructures };

/// Makes the structures; lengths go by the burr's radius:
/// - a nerve, a tube in the bone that crosses the drill's way;
/// - a sinus, a ball in the bone beside it, for a vein;
/// - the dura, a layer under the bone's far side: voxels without bone, reached by flooding from below the spot.
/// All ways lie in the plane of the surgeon's lean and outward directions. Throws std::runtime_error where the bone has
/// no surface beside the spot or no far side below it.
[[nodiscard]] MadeStructures make_structures(const Bone& bone, const Surgeon& surgeon);

}  // namespace drill
