// SPDX-License-Identifier: MIT
// Grids of other densities, with the same surface.
#include "support/check_refused.hpp"

#include <trephine/voxel/convert.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

TEST_CASE("converted: densities and what is outside are mapped, geometry and cuts stay") {
  const std::vector<std::uint8_t> voxels{0, 1, 2, 3, 250, 255};
  Posed X_WG = Posed::Identity();
  X_WG.translation() = Vec3d(0.1, 0.2, 0.3);
  VoxelGrid<std::uint8_t> bytes({.size = {3, 2, 1}, .spacing = {1e-3, 2e-3, 3e-3}, .X_WG = X_WG, .outside = 4},
                                std::span<const std::uint8_t>(voxels));
  bytes.lower_row(1, 0, 2, 2, [](int, int) { return std::uint8_t{7}; });
  bytes.commit();
  const auto wide = converted<std::int16_t>(bytes, 8, -1000);
  CHECK(wide.size() == bytes.size());
  CHECK(wide.spacing() == bytes.spacing());
  CHECK(wide.X_WG().matrix() == X_WG.matrix());
  CHECK(wide.outside() == -968);
  CHECK(wide.at(1, 0, 0) == -992);
  CHECK(wide.at(1, 1, 0) == 1000);
  CHECK(wide.at(2, 1, 0) == -944);
  const auto same = converted<float>(bytes);
  for (int i = 0; i < 3; ++i) CHECK(same.at(i, 0, 0) == static_cast<float>(bytes.at(i, 0, 0)));
}

TEST_CASE("converted: integers are rounded to the nearest, halves up") {
  const std::vector<float> voxels{-1.5F, -0.6F, 0.4F, 0.5F, 126.9F};
  const VoxelGrid<float> real({.size = {5, 1, 1}, .spacing = Vec3d::Constant(1e-3)}, std::span<const float>(voxels));
  const auto bytes = converted<std::int8_t>(real);
  const std::vector<int> expected{-1, -1, 0, 1, 127};
  for (int i = 0; i < 5; ++i) CHECK(bytes.at(i, 0, 0) == expected[static_cast<std::size_t>(i)]);
}

TEST_CASE("converted: what does not fit is refused") {
  const std::vector<std::int16_t> voxels{-1000, 1000};
  const VoxelGrid<std::int16_t> bone({.size = {2, 1, 1}, .spacing = Vec3d::Constant(1e-3)},
                                     std::span<const std::int16_t>(voxels));
  check_refused("from 0 to 255", [&] { static_cast<void>(converted<std::uint8_t>(bone)); });
  check_refused("from -128 to 127", [&] { static_cast<void>(converted<std::int8_t>(bone, 0.13)); });
  CHECK(converted<std::uint8_t>(bone, 0.1, 100).at(1, 0, 0) == 200);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
    check_refused("scale", [&] { static_cast<void>(converted<float>(bone, bad)); });
  check_refused("offset", [&] { static_cast<void>(converted<float>(bone, 1, nan)); });
}

}  // namespace
