// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <cstddef>
#include <vector>

namespace trephine::test {

/// All densities of a grid, x fastest.
template <class Density>
[[nodiscard]] std::vector<Density> densities(const VoxelGrid<Density>& grid) {
  std::vector<Density> v(static_cast<std::size_t>(grid.size()[0]) * static_cast<std::size_t>(grid.size()[1]) *
                         static_cast<std::size_t>(grid.size()[2]));
  grid.copy_voxels(v);
  return v;
}

/// Trilinear interpolation, by its definition, of a cube of `size` voxels a side at the voxel coordinates u.
template <class Density>
[[nodiscard]] double interpolated(const std::vector<Density>& v, int size, const Vec3d& u) {
  double sum = 0;
  const Vec3d lo = u.array().floor();
  for (int c = 0; c < 8; ++c) {
    double weight = 1;
    std::size_t at = 0, pitch = 1;
    for (int a = 0; a < 3; ++a) {
      const int one = c >> a & 1;
      weight *= one != 0 ? u[a] - lo[a] : 1 - (u[a] - lo[a]);
      at += pitch * static_cast<std::size_t>(lo[a] + one);
      pitch *= static_cast<std::size_t>(size);
    }
    sum += weight * static_cast<double>(v[at]);
  }
  return sum;
}

}  // namespace trephine::test
