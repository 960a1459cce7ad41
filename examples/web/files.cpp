// SPDX-License-Identifier: MIT
#include "files.hpp"

#include <trephine/voxel/brick_mesh.hpp>
#include <trephine/voxel/mesh_file.hpp>

#include <array>
#include <cstdint>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

namespace web {
namespace {

using trephine::Vec3d;

std::size_t voxels_of(const drill::Grid& grid) {
  std::size_t count = 1;
  for (const int n : grid.size()) count *= static_cast<std::size_t>(n);
  return count;
}

/// Calls `visit` with the indices of all voxels, x fastest.
template <class Visit>
void for_each_voxel(const drill::Grid& grid, Visit&& visit) {
  const auto& n = grid.size();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) visit(i, j, k);
}

}  // namespace

std::string stl_of(const drill::Bone& bone) {
  const trephine::GridReader<std::int16_t> reader(bone.grid, false);
  trephine::Mesh all;
  for (std::size_t b = 0; b < reader.brick_count(); ++b) {
    const trephine::Mesh mesh = trephine::brick_mesh(reader, b, bone.isovalue);
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& t : mesh.triangles) all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return trephine::stl_bytes(all, bone.grid.X_WG());
}

std::string nrrd_of(const drill::Bone& bone) {
  const trephine::GridReader<std::int16_t> reader(bone.grid, false);
  const auto& n = bone.grid.size();
  const Vec3d origin = 1e3 * bone.grid.X_WG().translation();
  std::array<char, 640> header{};
  int length = std::snprintf(header.data(), header.size(),
                             "NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\nsizes: %d %d %d\n"
                             "space directions:",
                             n[0], n[1], n[2]);
  const auto vector = [&](const Vec3d& v, const char* before) {
    length += std::snprintf(header.data() + length, header.size() - static_cast<std::size_t>(length),
                            "%s(%.9g,%.9g,%.9g)", before, v.x(), v.y(), v.z());
  };
  for (int a = 0; a < 3; ++a) vector(1e3 * bone.grid.spacing()[a] * bone.grid.X_WG().linear().col(a), " ");
  vector(origin, "\nspace origin: ");
  std::string bytes(header.data(), static_cast<std::size_t>(length));
  bytes += "\nspace units: \"mm\" \"mm\" \"mm\"\nendian: little\nencoding: raw\n\n";
  bytes.reserve(bytes.size() + 2 * voxels_of(bone.grid));
  for_each_voxel(bone.grid, [&](int i, int j, int k) { trephine::append_number(bytes, reader.voxel(i, j, k)); });
  return bytes;
}

drill::Bone as_loaded(const drill::Bone& bone) {
  const drill::Grid& grid = bone.grid;
  std::vector<std::int16_t> voxels;
  voxels.reserve(voxels_of(grid));
  const std::int16_t* const original = grid.original_data();
  for_each_voxel(grid, [&](int i, int j, int k) { voxels.push_back(original[grid.index(i, j, k)]); });
  return {.name = bone.name,
          .unit = bone.unit,
          .grid = drill::Grid({.size = grid.size(),
                               .spacing = grid.spacing(),
                               .X_WG = grid.X_WG(),
                               .outside = static_cast<double>(grid.outside())},
                              std::span<const std::int16_t>(voxels)),
          .isovalue = bone.isovalue,
          .burr = bone.burr,
          .notes = bone.notes,
          .tool_name = bone.tool_name,
          .tool = bone.tool,
          .scale = bone.scale,
          .offset = bone.offset};
}

}  // namespace web
