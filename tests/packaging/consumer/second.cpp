// SPDX-License-Identifier: MIT
// The header of main.cpp again: what is not inline in it is then defined twice.
#include <trephine/voxel/voxel_grid.hpp>

#include <cstdint>

double density_in_second_unit(const trephine::VoxelGrid<std::int16_t>& bone) { return bone.at(1, 1, 1); }
