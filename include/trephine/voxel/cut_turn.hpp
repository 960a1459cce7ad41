// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// A turn of several in which a large cut does its work, a tick each: the parts of the bone that belong to it. A part
/// is a box of 4 × 1 × 1 bricks of the grid. It belongs to the same turn always, so that what one turn leaves out the
/// others do.
struct CutTurn {
  static constexpr int kMost = 16;                        ///< turns
  static constexpr std::array<int, 3> kVoxels{32, 8, 8};  ///< along a part's edges
  int turn = 0, turns = 1;

  /// Returns the first voxel of the next part along an axis.
  [[nodiscard]] static constexpr int next(int voxel, std::size_t axis) noexcept {
    return (voxel / kVoxels[axis] + 1) * kVoxels[axis];
  }

  /// Returns whether voxel (i, j, k) belongs to this turn. Among the parts of any region all turns are about as
  /// frequent: fractions of multiples of ϕ⁻¹, ϕ⁻², ϕ⁻³ with ϕ⁴ = ϕ + 1 fill the interval from 0 to 1 evenly.
  [[nodiscard]] constexpr bool has(int i, int j, int k) const noexcept {
    const std::uint32_t fraction = static_cast<std::uint32_t>(i / kVoxels[0]) * 0xD1B54A33U +
                                   static_cast<std::uint32_t>(j / kVoxels[1]) * 0xABC98388U +
                                   static_cast<std::uint32_t>(k / kVoxels[2]) * 0x8CB92BA7U;
    return static_cast<int>(std::uint64_t{fraction} * static_cast<std::uint32_t>(turns) >> 32U) == turn;
  }
};

}  // namespace trephine
