// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <functional>
#include <string>
#include <utility>
#include <vector>

/// Trilinear interpolation by other libraries. Each has a file in others/, which is built where the library is
/// installed and makes itself known here.
namespace trephine::bench {

/// Points of a tool at A p + t in voxels; voxel (0, 0, 0) is at 0.
struct PosedPoints {
  Mat3<float> A;
  Vec3<float> t;
  const float* x;
  const float* y;
  const float* z;
  int count;

  [[nodiscard]] Vec3<float> operator[](int i) const { return A * Vec3<float>(x[i], y[i], z[i]) + t; }
};

/// Writes the densities at all points.
using OtherSampling = std::function<void(const PosedPoints&, float* out)>;

struct OtherLibrary {
  std::string name;
  std::function<OtherSampling(const VoxelGrid<std::uint8_t>&)> make;
};

/// Those this program was built with.
[[nodiscard]] inline std::vector<OtherLibrary>& other_libraries() {
  static std::vector<OtherLibrary> all;
  return all;
}

/// `const Known me{"name", make};` in a library's file.
struct Known {
  Known(std::string name, std::function<OtherSampling(const VoxelGrid<std::uint8_t>&)> make) {
    other_libraries().push_back({std::move(name), std::move(make)});
  }
};

/// Calls f(i, j, k, density) for all voxels.
template <class F>
void for_each_voxel(const VoxelGrid<std::uint8_t>& grid, F&& f) {
  for (int k = 0; k < grid.size()[2]; ++k)
    for (int j = 0; j < grid.size()[1]; ++j)
      for (int i = 0; i < grid.size()[0]; ++i) f(i, j, k, grid.at(i, j, k));
}

}  // namespace trephine::bench
