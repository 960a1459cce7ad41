// SPDX-License-Identifier: MIT
#include "speed/speed_scene.hpp"

#include <array>
#include <cmath>

namespace trephine::bench::speed {
/// Bytes of a grid and what goes with it.
void measure_memory(const Options& options) {
  Table table(options.folder + "/speed_memory.csv", "voxels,density,grid_MB,bytes_per_voxel,without_original_MB");
  const auto row = [&]<class Density>(int side, Density) {
    const double count = std::pow(side, 3);
    const std::vector<Density> none(static_cast<std::size_t>(count));
    const std::array<int, 3> size{side, side, side};
    const GridGeometry geometry{.size = size, .spacing = Vec3d::Constant(1e-4)};
    double bare = 0;
    {
      const VoxelGrid<Density> grid(geometry, none, {.keep_original = false});
      bare = static_cast<double>(grid.bytes());
    }
    const double all = bare + std::pow(side + 2, 3) * sizeof(Density);
    table.row(side, sizeof(Density) == 1 ? "8 bit" : "16 bit", all / 1e6, all / count, bare / 1e6);
  };
  for (const int side : {256, 512}) {
    row(side, std::uint8_t{});
    row(side, std::int16_t{});
  }
  if (!options.quick) row(1024, std::uint8_t{});
}

}  // namespace trephine::bench::speed
