// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/session/tick_bytes.hpp>
#include <trephine/voxel/brick_layout.hpp>
#include <trephine/voxel/density_type.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

/// The bone of a session: which it was, and how it changed, as a SessionLog writes it that follows the bone.
namespace trephine::inline TREPHINE_ALIGNED {

/// FNV-1a hash of densities, x fastest, without the border (`VoxelGrid::copy_voxels`), in this machine's byte order.
template <VoxelDensity Density>
[[nodiscard]] std::uint64_t density_hash(std::span<const Density> voxels) noexcept {
  return recording_detail::fnv1a({reinterpret_cast<const char*>(voxels.data()), voxels.size_bytes()});
}

/// The bone as it was when a log began to follow it.
struct FollowedBone {
  GridGeometry geometry;  ///< with its `outside`
  DensityType density = DensityType::kFloat;
  std::optional<double> isovalue{};
  std::uint64_t hash = 0;  ///< of its densities (`density_hash`)

  [[nodiscard]] std::size_t voxels() const noexcept {
    const auto& n = geometry.size;
    return static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
  }
  /// Bricks along x, y, z; brick b is (b % x, b / x % y, b / (x y)), as in `VoxelGrid`.
  [[nodiscard]] std::array<int, 3> bricks() const noexcept {
    std::array<int, 3> bricks{};
    for (std::size_t a = 0; a < 3; ++a) bricks[a] = (geometry.size[a] - 1) / BrickLayout::kBrick + 1;
    return bricks;
  }
  /// Index (i, j, k) of a voxel by its number in a brick, x fastest.
  [[nodiscard]] std::array<int, 3> index(std::size_t brick, int number) const noexcept {
    constexpr int kSide = BrickLayout::kBrick;
    const auto n = bricks();
    const auto x = static_cast<std::size_t>(n[0]), y = static_cast<std::size_t>(n[1]);
    return {kSide * static_cast<int>(brick % x) + number % kSide,
            kSide * static_cast<int>(brick / x % y) + number / kSide % kSide,
            kSide * static_cast<int>(brick / x / y) + number / (kSide * kSide)};
  }
  /// True for the very densities with which the session began.
  template <VoxelDensity Density>
  [[nodiscard]] bool began_with(std::span<const Density> densities) const noexcept {
    return kDensityType<Density> == density && densities.size() == voxels() && density_hash(densities) == hash;
  }
};

/// Voxels of a brick whose densities changed since the brick was last written, or since the start.
struct BrickChange {
  struct Voxel {
    std::uint16_t number = 0;  ///< in the brick, x fastest (`FollowedBone::index`)
    float density = 0;         ///< the new one, which a float holds exactly for every type
  };
  std::size_t brick = 0;
  std::vector<Voxel> voxels;  ///< by rising number
};

/// Puts the new densities into those of the bone, x fastest. All changes of a session, in order, turn the bone that it
/// began with into the bone that it left, bit for bit. Throws std::invalid_argument for another type or number of
/// voxels.
template <VoxelDensity Density>
void apply_change(const FollowedBone& bone, const BrickChange& change, std::span<Density> densities) {
  if (kDensityType<Density> != bone.density)
    refuse("apply_change", "densities must be of the bone's own type", static_cast<int>(kDensityType<Density>));
  if (densities.size() != bone.voxels()) refuse("apply_change", "densities must be the bone's", densities.size());
  const auto& n = bone.geometry.size;
  for (const BrickChange::Voxel& v : change.voxels) {
    const auto [i, j, k] = bone.index(change.brick, v.number);
    const std::size_t row = static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j);
    densities[row * static_cast<std::size_t>(n[0]) + static_cast<std::size_t>(i)] = static_cast<Density>(v.density);
  }
}

}  // namespace trephine
