// SPDX-License-Identifier: MIT
// The example host's mesh extraction: brick by brick it gives one closed surface.
#include <doctest/doctest.h>

#include <trephine/core/units.hpp>

#include "brick_surface.hpp"
#include "support/near.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr double kIsovalue = 100;

/// Density falls by 40 a voxel outward from a ball, 0 at least.
VoxelGrid<float> make_ball(const std::array<int, 3>& size, const Vec3d& centre, double radius_voxels) {
  std::vector<float> voxels;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const double inward = radius_voxels - (Vec3d(i, j, k) - centre).norm();
        voxels.push_back(static_cast<float>(std::max(0.0, kIsovalue + 40 * inward)));
      }
  return {{.size = size, .spacing = {1_mm, 1_mm, 1_mm}}, voxels};
}

struct Whole {
  double volume_mm3 = 0;
  int open_edges = 0;  // directed edges whose opposite is missing or is there twice
};

Whole assemble(const VoxelGrid<float>& bone) {
  Whole whole;
  // Bricks repeat the vertices that they share, bit by bit.
  using Point = std::array<float, 3>;
  std::map<std::pair<Point, Point>, int> edges;
  GridReader<float> reader(bone);
  reader.poll([&](std::size_t brick) {
    const auto surface = embed::extract_surface(reader, brick, kIsovalue);
    for (const auto& t : surface.triangles) {
      std::array<Point, 3> p;
      std::array<Vec3d, 3> v;
      for (std::size_t c = 0; c < 3; ++c) {
        p[c] = surface.vertices[t[c]];
        v[c] = 1e3 * Vec3d(p[c][0], p[c][1], p[c][2]);
      }
      for (std::size_t c = 0; c < 3; ++c) ++edges[{p[c], p[(c + 1) % 3]}];
      whole.volume_mm3 += v[0].dot(v[1].cross(v[2])) / 6;
    }
  });
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != count) ++whole.open_edges;
  }
  return whole;
}

}  // namespace

TEST_CASE("the bricks' surfaces close over a ball, outward, with its volume") {
  const double r = 9.3;
  const Whole ball = assemble(make_ball({27, 25, 29}, {13.2, 12.1, 14.4}, r));
  CHECK(ball.open_edges == 0);
  // Chords lie inside a sphere: the mesh is a little smaller.
  CHECK(ball.volume_mm3 == near(4 * std::numbers::pi / 3 * r * r * r, 0.02));
}

TEST_CASE("a surface that leaves the grid is closed at its border, whole last bricks or not") {
  for (const int n : {16, 19})
    for (const double at : {0.0, n - 1.0}) {
      const Whole part = assemble(make_ball({n, n, n}, {at, at, at}, 8));
      CHECK(part.open_edges == 0);
      // An eighth of the ball, and up to a voxel more on the three cut faces.
      CHECK(part.volume_mm3 > 4 * std::numbers::pi / 3 * 512 / 8);
      CHECK(part.volume_mm3 < 4 * std::numbers::pi / 3 * 729 / 8 * 1.3);
    }
}
