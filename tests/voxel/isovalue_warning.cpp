// SPDX-License-Identifier: MIT
// Isovalues that find no surface in an image.
#include <trephine/voxel/isovalue_warning.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace {

using namespace trephine;

TEST_CASE("isovalue warning: above all densities, or at or below all of them and what is outside") {
  const auto warning = [](double isovalue, double outside) {
    const std::vector<std::int16_t> voxels{-1000, 200, 1500, 1500};
    VoxelGrid<std::int16_t> grid({.size = {4, 1, 1}, .spacing = Vec3d::Constant(1e-3), .outside = outside},
                                 std::span<const std::int16_t>(voxels));
    // Bone that is drilled away later does not matter.
    grid.lower_row(0, 0, 0, 3, [](int, int) { return std::int16_t{-1024}; });
    grid.commit();
    return isovalue_warning(grid, isovalue);
  };
  for (const double fits : {-999.5, 300.0, 1500.0}) CHECK(warning(fits, -1000).empty());
  CHECK(warning(-1000, -1001).empty());  // a solid block in air
  CHECK(warning(1501, 2000).empty());    // a hollow in bone
  CHECK(warning(1501, -1000).find("above every density") != std::string::npos);
  CHECK(warning(-1000, -1000).find("all is bone") != std::string::npos);
  CHECK(warning(-5000, -1000).find("-1000 to 1500") != std::string::npos);
}

}  // namespace
