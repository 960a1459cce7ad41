// SPDX-License-Identifier: MIT
// says: convert your densities to one of them
#include <trephine/voxel/voxel_grid.hpp>

#include <vector>

using namespace trephine;

VoxelGrid<int> bone({.size = {4, 4, 4}, .spacing = {1e-3, 1e-3, 1e-3}}, std::vector<int>(64));
