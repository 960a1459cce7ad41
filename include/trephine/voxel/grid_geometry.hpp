// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>

namespace trephine::inline TREPHINE_ALIGNED {

/// The number formats of a voxel: integers of 8 or 16 bits, and float. The set is closed: sampling loads pairs of
/// neighbours as words, and files store these formats.
template <class T>
concept VoxelDensity = std::same_as<T, std::uint8_t> || std::same_as<T, std::int8_t> ||
                       std::same_as<T, std::uint16_t> || std::same_as<T, std::int16_t> || std::same_as<T, float>;

/// Size, spacing and pose of a grid. Voxel (i, j, k) is a sample at its **centre**, which lies at `spacing * (i, j, k)`
/// in G.
struct GridGeometry {
  std::array<int, 3> size{};        ///< voxels along x (fastest in memory), y, z; each >= 1
  Vec3d spacing = Vec3d::Zero();    ///< [m], each > 0
  Posed X_WG = Posed::Identity();   ///< pose of voxel (0,0,0)'s centre and the grid's axes in the world
  std::optional<double> outside{};  ///< density beyond the grid; the smallest in the data unless given
};

/// Optional memory of a grid.
struct GridOptions {
  bool keep_original = true;  ///< store a copy for `restore()`: one more Density a voxel
};

}  // namespace trephine
