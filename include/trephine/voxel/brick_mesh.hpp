// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/grid_reader.hpp>
#include <trephine/voxel/mesh.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// One brick's share of the bone's surface, for a thread that draws what the haptic thread drills: call it for each
/// brick that `reader.poll` names, and replace that brick's mesh. Bricks' meshes meet without a crack, bit by bit, once
/// all changed bricks are made anew; a surface that leaves the grid is closed at its border. Takes memory, some tens of
/// microseconds where a surface passes, and no lock.
///
/// Surface nets (S. Gibson, Constrained elastic surface nets, MICCAI 1998): a vertex in each cell of eight voxels that
/// the surface passes, at the mean of its crossings with the cell's edges, and a quad round each edge that it crosses.
/// An edge belongs to the brick of its first voxel, and vertices of neighbours are found again from the halo.
///
/// Puts a unit normal out of the bone for each vertex in `normals`, unless it is null: against the gradient at the
/// middle of the vertex's cell, so bricks agree on it bit by bit; +z where the gradient is zero.
template <VoxelDensity Density>
[[nodiscard]] Mesh brick_mesh(const GridReader<Density>& bone, std::size_t brick, double isovalue,
                              std::vector<std::array<float, 3>>* normals = nullptr) {
  constexpr int kSide = GridReader<Density>::kHaloed;
  constexpr int kCells = kSide - 1;
  std::array<Density, std::size_t{kSide} * kSide * kSide> voxels;
  Mesh out;
  if (normals != nullptr) normals->clear();
  const auto range = bone.copy_brick(brick, voxels);
  if (range.max < isovalue || range.min >= isovalue) return out;

  const auto at = bone.brick_coordinates(brick);
  const auto value = [&](const std::array<int, 3>& u) {
    return static_cast<double>(voxels[static_cast<std::size_t>((u[2] * kSide + u[1]) * kSide + u[0])]) - isovalue;
  };
  const auto to = [](std::array<int, 3> u, std::size_t axis, int step) {
    u[axis] += step;
    return u;
  };
  // Cells and voxels are counted from the halo's corner; the brick's own first voxel is (1, 1, 1).
  const auto vertex = [&](const std::array<int, 3>& cell) {
    Vec3d sum = Vec3d::Zero(), fall = Vec3d::Zero();
    int crossings = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int edge = 0; edge < 4; ++edge) {
        const auto a = to(to(cell, (axis + 1) % 3, edge & 1), (axis + 2) % 3, edge >> 1);
        const double from = value(a);
        const double end = value(to(a, axis, 1));
        fall[static_cast<int>(axis)] += from - end;
        if ((from >= 0) == (end >= 0)) continue;
        Vec3d p(a[0], a[1], a[2]);
        p[static_cast<int>(axis)] += from / (from - end);
        sum += p;
        ++crossings;
      }
    // From the grid's own indices on, so that two bricks that share a cell find the same bits.
    const Vec3d first(8 * at[0] - 1, 8 * at[1] - 1, 8 * at[2] - 1);
    const Vec3d p_G = bone.spacing().cwiseProduct(first + sum / crossings);
    if (normals != nullptr) {
      const Vec3d n = fall.isZero(0) ? Vec3d::UnitZ() : Vec3d(fall.cwiseQuotient(bone.spacing()).stableNormalized());
      normals->push_back({static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z())});
    }
    return p_G.cast<float>().eval();
  };

  std::array<int, std::size_t{kCells} * kCells * kCells> known;
  known.fill(-1);
  const auto index_of = [&](const std::array<int, 3>& cell) {
    int& index = known[static_cast<std::size_t>((cell[2] * kCells + cell[1]) * kCells + cell[0])];
    if (index < 0) {
      index = static_cast<int>(out.vertices.size());
      const auto p = vertex(cell);
      out.vertices.push_back({p.x(), p.y(), p.z()});
    }
    return static_cast<std::uint32_t>(index);
  };

  for (int z = 0; z <= 8; ++z)
    for (int y = 0; y <= 8; ++y)
      for (int x = 0; x <= 8; ++x)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::array<int, 3> u{x, y, z};
          // Of the halo before the brick, only edges out of the grid's border are its own.
          bool own = true;
          for (std::size_t a = 0; a < 3; ++a) own = own && (u[a] > 0 || (a == axis && at[a] == 0));
          if (!own) continue;
          const bool inside = value(u) >= 0;
          if (inside == (value(to(u, axis, 1)) >= 0)) continue;
          const std::size_t b = (axis + 1) % 3;
          const std::size_t c = (axis + 2) % 3;
          std::array q{index_of(to(to(u, b, -1), c, -1)), index_of(to(u, c, -1)), index_of(u), index_of(to(u, b, -1))};
          if (!inside) std::swap(q[1], q[3]);
          out.triangles.push_back({q[0], q[1], q[2]});
          out.triangles.push_back({q[0], q[2], q[3]});
        }
  return out;
}

/// The whole bone's surface, vertices that bricks share joined: to save or measure, while no other thread edits the
/// grid. Takes half a second for ten million voxels.
template <VoxelDensity Density>
[[nodiscard]] Mesh bone_mesh(const VoxelGrid<Density>& bone, double isovalue) {
  GridReader<Density> reader(bone);
  Mesh whole;
  std::map<std::array<float, 3>, std::uint32_t> known;
  reader.poll([&](std::size_t brick) {
    const Mesh part = brick_mesh(reader, brick, isovalue);
    std::vector<std::uint32_t> index;
    for (const auto& vertex : part.vertices) {
      const auto [at, fresh] = known.try_emplace(vertex, static_cast<std::uint32_t>(whole.vertices.size()));
      if (fresh) whole.vertices.push_back(vertex);
      index.push_back(at->second);
    }
    for (const auto& t : part.triangles) whole.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
  });
  return whole;
}

}  // namespace trephine
