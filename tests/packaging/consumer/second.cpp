// SPDX-License-Identifier: MIT
#include <trephine/trephine.hpp>

#include <cstdint>

double density_in_second_unit(const trephine::VoxelGrid<std::int16_t>& bone) { return bone.at(1, 1, 1); }
