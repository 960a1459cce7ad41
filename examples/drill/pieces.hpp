// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <cstddef>
#include <cstdint>

namespace drill {

struct Pieces {
  std::size_t removed = 0;         ///< pieces taken away
  std::size_t removed_voxels = 0;  ///< and their voxels
};

/// Keeps the largest connected piece (over voxels' faces) of what reaches the isovalue and lowers all others to just
/// below it: a scanner's head rest, specks. The grid's originals are lowered too.
Pieces keep_largest_piece(trephine::VoxelGrid<std::int16_t>& grid, double isovalue);

}  // namespace drill
