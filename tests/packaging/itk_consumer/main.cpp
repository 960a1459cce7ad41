// SPDX-License-Identifier: MIT
#include <trephine/adapter/itk.hpp>
#include <trephine/adapter/itk_save.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

int main() {
  using Bone = trephine::VoxelGrid<std::int16_t>;
  const std::vector<std::int16_t> voxels{-1000, 300, 300, 300, 300, 300, 300, 300};
  trephine::save_volume("bone.nrrd", Bone({.size = {2, 2, 2}, .spacing = {1e-3, 1e-3, 1e-3}}, voxels));
  const Bone again = trephine::read_volume_as<std::int16_t>("bone.nrrd", {.isovalue = 0});
  if (again.at(1, 1, 1) != 300.0 || again.at(0, 0, 0) != -1000.0) return 1;
  std::printf("0 N, %g mm3\n", 1e9 * again.spacing().prod());
}
