// SPDX-License-Identifier: MIT
#include <trephine/version.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

double density_in_second_unit(const trephine::VoxelGrid<std::int16_t>& bone);

int main() {
  const std::vector<std::int16_t> voxels(8, 300);
  const trephine::VoxelGrid<std::int16_t> bone({.size = {2, 2, 2}, .spacing = {1e-3, 1e-3, 1e-3}}, voxels);
  if (density_in_second_unit(bone) != 300.0) return 1;
  std::printf("trephine %d.%d.%d works\n", trephine::kVersionMajor, trephine::kVersionMinor, trephine::kVersionPatch);
}
