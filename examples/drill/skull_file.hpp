// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <cstdint>
#include <string>

namespace drill {

/// Reads the CT volume of an InVesalius project's folder: `main.plist` says shape and spacing, `matrix.dat` holds
/// little-endian int16 Hounsfield units without a header. Rows lie the other way round than in DICOM; they are turned,
/// so that x, y, z point left, back and up as DICOM has them and the volume is right-handed. Which side is left is not
/// recorded in the file and was not verified. Throws std::runtime_error: what, where, what to do.
[[nodiscard]] trephine::VoxelGrid<std::int16_t> read_skull(const std::string& folder);

}  // namespace drill
