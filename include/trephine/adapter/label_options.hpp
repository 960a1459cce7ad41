// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/structure/label_grid.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options for reading labels. Each default refuses the file where a structure could be lost unnoticed.
struct LabelFileOptions {
  /// Structures in place of the file's, by label. For plain images, which hold no names: they are named "label 3", and
  /// coloured from a palette, if this is empty.
  std::vector<Structure> structures{};
  bool ignore_unlisted = false;      ///< voxels whose number belongs to no structure count as none
  bool drop_empty = false;           ///< structures without a voxel are left out
  bool later_layer_wins = false;     ///< where segments overlap, the voxel belongs to the last layer's
  std::optional<Vec3d> spacing_m{};  ///< replaces the file's spacing [m], for formats and files without a unit
};

/// Account of what reading left out, by the options that allow it.
struct LabelReport {
  std::size_t overlapped_voxels = 0;   ///< voxels that lay in several segments
  std::size_t unlisted_voxels = 0;     ///< voxels that belonged to no structure, not counting 0
  std::vector<std::string> dropped{};  ///< names of structures without a voxel
};

}  // namespace trephine
