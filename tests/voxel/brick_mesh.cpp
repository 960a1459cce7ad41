// SPDX-License-Identifier: MIT
// A mesh made brick by brick is one closed surface, also as the bone is drilled, and files hold it.
#include <doctest/doctest.h>

#include <trephine/core/units.hpp>

#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/cutter.hpp>
#include <trephine/voxel/mesh_file.hpp>

#include "support/near.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <string>
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

using Point = std::array<float, 3>;

void add(const Mesh& part, std::map<std::pair<Point, Point>, int>& edges, double& volume_mm3) {
  for (const auto& t : part.triangles) {
    std::array<Vec3d, 3> v;
    for (std::size_t c = 0; c < 3; ++c) {
      const Point& p = part.vertices[t[c]];
      v[c] = 1e3 * Vec3d(p[0], p[1], p[2]);
      ++edges[{p, part.vertices[t[(c + 1) % 3]]}];
    }
    volume_mm3 += v[0].dot(v[1].cross(v[2])) / 6;
  }
}

/// Bricks repeat the vertices that they share, bit by bit, so edges are told apart by their ends' places.
Whole assemble(const std::map<std::size_t, Mesh>& bricks) {
  Whole whole;
  std::map<std::pair<Point, Point>, int> edges;
  for (const auto& [brick, part] : bricks) add(part, edges, whole.volume_mm3);
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != count) ++whole.open_edges;
  }
  return whole;
}

Whole assemble(const VoxelGrid<float>& bone) {
  std::map<std::size_t, Mesh> bricks;
  GridReader<float> reader(bone);
  reader.poll([&](std::size_t brick) { bricks[brick] = brick_mesh(reader, brick, kIsovalue); });
  return assemble(bricks);
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

TEST_CASE("bricks that changed, made anew, join those that did not") {
  VoxelGrid<float> bone = make_ball({40, 40, 40}, {19.2, 19.1, 18.4}, 15);
  GridReader<float> reader(bone);
  std::map<std::size_t, Mesh> bricks;
  std::size_t made = reader.poll([&](std::size_t b) { bricks[b] = brick_mesh(reader, b, kIsovalue); });
  const double before = assemble(bricks).volume_mm3;
  double removed = 0;
  for (int i = 0; i < 12; ++i) {
    const Vec3d from(19_mm, 20_mm, 38_mm - 1.5_mm * i), to(19_mm, 20_mm, 36.5_mm - 1.5_mm * i);
    removed += carve(bone, kIsovalue, SphereCutter(from, to, 2.5_mm));
    made = reader.poll([&](std::size_t b) { bricks[b] = brick_mesh(reader, b, kIsovalue); });
    CHECK(made < bricks.size());
    const Whole now = assemble(bricks);
    CHECK(now.open_edges == 0);
    // The mesh's chords against the interpolant's volume: a share of the hole's wall.
    CHECK(before - now.volume_mm3 == near(removed, 0.05));
  }
  CHECK(removed > 280);  // a hole of 5 mm diameter and 13 mm deep
}

TEST_CASE("normals are unit, out of the bone, and the same in every brick that has the vertex") {
  // A ball in millimetres, in voxels as long as a CT's slices are apart.
  const Vec3d spacing(0.5_mm, 0.7_mm, 1.1_mm), centre(10_mm, 10.2_mm, 9.8_mm);
  const std::array<int, 3> size{41, 30, 19};
  std::vector<float> voxels;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        voxels.push_back(
            static_cast<float>(kIsovalue + 4e4 * (7_mm - (spacing.cwiseProduct(Vec3d(i, j, k)) - centre).norm())));
  const VoxelGrid<float> bone({.size = size, .spacing = spacing}, voxels);
  GridReader<float> reader(bone);
  std::map<Point, Point> known;
  int shared = 0, differ = 0;
  double least = 1;
  reader.poll([&](std::size_t b) {
    std::vector<Point> normals{{7, 7, 7}};  // of another brick
    const Mesh part = brick_mesh(reader, b, kIsovalue, &normals);
    CHECK(part == brick_mesh(reader, b, kIsovalue));
    REQUIRE(normals.size() == part.vertices.size());
    for (std::size_t v = 0; v < normals.size(); ++v) {
      const Vec3d n(normals[v][0], normals[v][1], normals[v][2]);
      CHECK(n.norm() == near(1, 1e-6));
      const Point& p = part.vertices[v];
      least = std::min(least, n.dot((Vec3d(p[0], p[1], p[2]) - centre).normalized()));
      const auto [at, fresh] = known.try_emplace(p, normals[v]);
      if (!fresh) ++shared;
      if (at->second != normals[v]) ++differ;
    }
  });
  CHECK(shared > 300);
  CHECK(differ == 0);
  // The cell's middle is half its diagonal of 1.4 mm from the vertex at most, a tenth of the radius: 0.1 rad.
  CHECK(least > std::cos(0.1));

  // Where densities fall nowhere there is a direction, too: a saddle of four corners.
  std::vector<float> saddle(8, 0);
  saddle[0] = saddle[3] = saddle[5] = saddle[6] = 200;
  const VoxelGrid<float> corners({.size = {2, 2, 2}, .spacing = {1_mm, 1_mm, 1_mm}, .outside = 0}, saddle);
  GridReader<float> one(corners);
  std::vector<Point> normals;
  const Mesh part = brick_mesh(one, 0, kIsovalue, &normals);
  int up = 0;
  for (std::size_t v = 0; v < normals.size(); ++v)
    if (part.vertices[v] == Point{0.5e-3F, 0.5e-3F, 0.5e-3F}) up += normals[v] == Point{0, 0, 1};
  CHECK(up == 1);
}

TEST_CASE("a whole bone's mesh shares its vertices, and files hold it in millimetres") {
  const VoxelGrid<float> bone = make_ball({27, 25, 29}, {13.2, 12.1, 14.4}, 9.3);
  const Mesh mesh = bone_mesh(bone, kIsovalue);
  // Euler: a closed surface without handles has two vertices more than half its triangles.
  CHECK(2 * mesh.vertices.size() == mesh.triangles.size() + 4);
  Posed X_WG = Posed::Identity();
  X_WG.translation() = Vec3d(0.1, 0, 0);

  const auto folder = std::filesystem::temp_directory_path();
  const auto read = [&](const char* name) {
    std::ifstream file(folder / name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    file.close();
    std::filesystem::remove(folder / name);
    return bytes;
  };
  const auto number = [](const std::string& bytes, std::size_t at) {
    float value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return static_cast<double>(value);
  };
  save_stl(folder / "trephine_mesh.stl", mesh, X_WG);
  const std::string stl = read("trephine_mesh.stl");
  REQUIRE(stl.size() == 84 + 50 * mesh.triangles.size());
  CHECK(stl == stl_bytes(mesh, X_WG));
  const Vec3d centre(113.2, 12.1, 14.4);
  double volume = 0;
  for (std::size_t at = 84; at < stl.size(); at += 50) {
    std::array<Vec3d, 4> v;  // normal, corners
    for (std::size_t i = 0; i < 12; ++i) v[i / 3][static_cast<int>(i % 3)] = number(stl, at + 4 * i);
    CHECK(v[0].dot((v[1] - centre).normalized()) > 0.8);  // outward
    volume += (v[1] - centre).dot((v[2] - centre).cross(v[3] - centre)) / 6;
  }
  CHECK(volume == near(4 * std::numbers::pi / 3 * 9.3 * 9.3 * 9.3, 0.02));

  save_ply(folder / "trephine_mesh.ply", mesh, X_WG);
  const std::string ply = read("trephine_mesh.ply");
  const std::size_t body = ply.find("end_header\n") + 11;
  REQUIRE(ply.size() == body + 12 * mesh.vertices.size() + 13 * mesh.triangles.size());
  CHECK(ply.find("element vertex " + std::to_string(mesh.vertices.size())) < body);
  CHECK(number(ply, body) == near(1e3 * (0.1 + static_cast<double>(mesh.vertices[0][0])), 1e-6));
  std::uint32_t last = 0;
  std::memcpy(&last, ply.data() + ply.size() - 4, 4);
  CHECK(last == mesh.triangles.back()[2]);
  CHECK_THROWS_AS(save_stl("/nowhere/mesh.stl", mesh), std::runtime_error);
}
