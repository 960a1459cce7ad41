// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/core/math.hpp>
#include <trephine/voxel/mesh.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <string>

/// Saves meshes for printers, CAD and viewers, which expect millimetres. Not for the haptic thread.
namespace trephine::inline TREPHINE_ALIGNED {

namespace mesh_detail {

/// A number as the formats have it: the least byte first.
template <class Number>
void put(std::string& bytes, Number value) {
  append_number(bytes, value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.end() - sizeof(Number), bytes.end());
}

inline void put(std::string& bytes, const Vec3d& v) {
  for (int i = 0; i < 3; ++i) put(bytes, static_cast<float>(v[i]));
}

/// A vertex in the file's frame [mm].
[[nodiscard]] inline Vec3d placed(const Mesh& mesh, std::uint32_t vertex, const Posed& X_WG) {
  const auto& p = mesh.vertices[vertex];
  return 1e3 * (X_WG * Vec3d(p[0], p[1], p[2]));
}

}  // namespace mesh_detail

/// Returns the bytes of a binary STL file, in millimetres. `X_WG` is the pose of the mesh in the file's frame: the
/// grid's `X_WG()` gives the scanner's.
[[nodiscard]] inline std::string stl_bytes(const Mesh& mesh, const Posed& X_WG = Posed::Identity()) {
  std::string bytes("binary STL, millimetres");
  bytes.resize(80, ' ');
  mesh_detail::put(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const Vec3d a = mesh_detail::placed(mesh, t[0], X_WG), b = mesh_detail::placed(mesh, t[1], X_WG),
                c = mesh_detail::placed(mesh, t[2], X_WG);
    mesh_detail::put(bytes, (b - a).cross(c - a).stableNormalized());
    for (const Vec3d& p : {a, b, c}) mesh_detail::put(bytes, p);
    mesh_detail::put(bytes, std::uint16_t{0});
  }
  return bytes;
}

/// Writes `stl_bytes` to a file. Throws std::runtime_error if the file cannot be written.
inline void save_stl(const std::filesystem::path& path, const Mesh& mesh, const Posed& X_WG = Posed::Identity()) {
  write_file(path, "save_stl", stl_bytes(mesh, X_WG));
}

/// Writes a binary PLY file, in millimetres, in which triangles share their vertices. Otherwise as `save_stl`.
inline void save_ply(const std::filesystem::path& path, const Mesh& mesh, const Posed& X_WG = Posed::Identity()) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment millimetres\nelement vertex " +
                      std::to_string(mesh.vertices.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                      std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) mesh_detail::put(bytes, mesh_detail::placed(mesh, v, X_WG));
  for (const auto& t : mesh.triangles) {
    mesh_detail::put(bytes, std::uint8_t{3});
    for (const std::uint32_t v : t) mesh_detail::put(bytes, v);
  }
  write_file(path, "save_ply", bytes);
}

}  // namespace trephine
