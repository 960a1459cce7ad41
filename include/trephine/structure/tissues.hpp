// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/label_grid.hpp>
#include <trephine/voxel/tissue_cut.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// How fast the drill cuts the voxels of one label.
struct Tissue {
  std::uint16_t label = 0;  ///< one that the labels list; 0 for all voxels without an entry
  double rate = 1;          ///< factor on the cut's rate or speed, 0.001 to 1000
};

/// Makes a map of a bone's tissues from labels, for `TissueCut`. Each voxel has the label of the nearest label voxel,
/// and the rate of that label's entry, else of the entry for 0, else 1.
///
/// Throws std::invalid_argument for a label that is not listed, a label with two entries, a rate out of range, or more
/// than 256 different entries. Not for the haptic thread: it allocates, and takes 10 to 20 ns a voxel of the bone.
template <VoxelLabel Label, VoxelDensity Density>
[[nodiscard]] std::shared_ptr<const TissueMap> make_tissue_map(const LabelGrid<Label>& labels,
                                                               const VoxelGrid<Density>& bone,
                                                               std::span<const Tissue> tissues) {
  std::vector<double> rates{1};                                                             // 0: without an entry
  std::vector<std::uint8_t> tissue_of(std::size_t{std::numeric_limits<Label>::max()} + 1);  // by label
  std::vector<bool> given(tissue_of.size());
  for (const Tissue& t : tissues) {
    const std::string name = "label " + std::to_string(t.label);
    if (t.label != 0 && labels.find(t.label) == nullptr)
      refuse("make_tissue_map", "each tissue's label must be one of the segmentation's", name);
    if (given[t.label]) refuse("make_tissue_map", "each label may have one entry", name + " twice");
    given[t.label] = true;
    if (t.label == 0) {
      rates[0] = t.rate;
    } else {
      if (rates.size() >= TissueMap::kTissues) refuse("make_tissue_map", "at most 255 labels may have a rate", "more");
      tissue_of[t.label] = static_cast<std::uint8_t>(rates.size());
      rates.push_back(t.rate);
    }
  }
  const Posed X_SG = relative_pose(labels.X_WS(), bone.X_WG());
  return std::make_shared<const TissueMap>(bone, rates, [&](int i, int j, int k) {
    return tissue_of[labels.label_at(X_SG * Vec3d(bone.spacing().cwiseProduct(Vec3d(i, j, k))))];
  });
}

}  // namespace trephine
