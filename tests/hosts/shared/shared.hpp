// SPDX-License-Identifier: MIT
// What two translation units share.
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/voxel/voxel_grid.hpp>

double height_above(const trephine::VoxelGrid<float>& bone, const trephine::TickInput& input);
