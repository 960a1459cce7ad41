// SPDX-License-Identifier: MIT
#include "drawn_bone.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace trephine;
using chai3d_host::DrawnBone;
using chai3d_host::Grey;

constexpr std::array<int, 3> kSize{19, 10, 13};  // bricks are cut off at the far sides

VoxelGrid<std::int16_t> bone_of() {
  std::vector<std::int16_t> densities(std::size_t{19} * 10 * 13);
  for (std::size_t i = 0; i < densities.size(); ++i) densities[i] = static_cast<std::int16_t>(400 + i % 800);
  return VoxelGrid<std::int16_t>({kSize, {1e-3, 2e-3, 3e-3}, Posed(Eigen::Translation3d(1, 2, 3))}, densities);
}

void cut(VoxelGrid<std::int16_t>& bone, int x0, int x1, int y, int z) {
  bone.lower_row(y, z, x0, x1, [](int, std::int16_t) { return std::int16_t{-900}; });
  bone.commit();
}

unsigned char drawn_at(const DrawnBone<std::int16_t>& drawn, unsigned x, unsigned y, unsigned z) {
  chai3d::cColorb color;
  REQUIRE(drawn.image().getVoxelColor(x, y, z, color));
  return color.getR();
}

}  // namespace

TEST_CASE("CHAI3D: grey levels have the isovalue in the middle and end at black and white") {
  const Grey grey{.isovalue = 300, .range = 1300};
  CHECK(grey(299) == 127);
  CHECK(grey(301) == 128);
  CHECK(grey(-1000) == 0);
  CHECK(grey(1600) == 255);
  CHECK(grey(-32768) == 0);
  CHECK(grey(32767) == 255);
}

TEST_CASE("CHAI3D: the image is the bone from the start and after each cut") {
  chai3d::cWorld world;
  auto bone = bone_of();
  DrawnBone drawn(world, bone, Grey{});
  CHECK(drawn.differences() == 0);
  CHECK(drawn.changed_voxels() == 0);
  CHECK(drawn_at(drawn, 18, 9, 12) == Grey{}(bone.at(18, 9, 12)));
  CHECK(drawn.update() == 0);

  cut(bone, 15, 18, 9, 12);  // the farthest corner, across two bricks
  CHECK(drawn.differences() == 4);
  CHECK(drawn.update() >= 2);
  CHECK(drawn.differences() == 0);
  CHECK(drawn.changed_voxels() == 4);
  CHECK(drawn_at(drawn, 18, 9, 12) == Grey{}(-900));

  cut(bone, 0, 0, 0, 0);
  CHECK(drawn.update() >= 1);
  CHECK(drawn.differences() == 0);
  CHECK(drawn.changed_voxels() == 5);
}

TEST_CASE("CHAI3D: regions are joined while no picture takes them") {
  chai3d::cWorld world;
  auto bone = bone_of();
  DrawnBone drawn(world, bone, Grey{});
  cut(bone, 2, 3, 4, 5);
  (void)drawn.update();
  cut(bone, 17, 18, 9, 12);
  (void)drawn.update();
  const auto [first, last] = drawn.marked();
  for (std::size_t a = 0; a < 3; ++a) {
    CHECK(first[a] <= std::array{2, 4, 5}[a]);
    CHECK(last[a] >= std::array{18, 9, 12}[a]);
  }
}

TEST_CASE("CHAI3D: the volume's box has each voxel at its place") {
  chai3d::cWorld world;
  const auto bone = bone_of();
  DrawnBone drawn(world, bone, Grey{});
  const chai3d::cVoxelObject& object = drawn.object();
  CHECK(object.getLocalPos().equals(chai3d::cVector3d(1, 2, 3)));
  // Voxel i of n is at (i + 1/2) / n of the box in a texture, and at i spacings in G.
  for (int axis = 0; axis < 3; ++axis) {
    const double low = object.m_minCorner(axis), high = object.m_maxCorner(axis);
    const int n = kSize[static_cast<std::size_t>(axis)];
    for (const int i : {0, n - 1})
      CHECK(std::abs(low + (i + 0.5) / n * (high - low) - i * bone.spacing()[axis]) < 1e-15);
  }
}
