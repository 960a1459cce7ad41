// SPDX-License-Identifier: MIT
// says: include trephine before X11
#define Status int
#include <trephine/voxel/voxel_grid.hpp>
