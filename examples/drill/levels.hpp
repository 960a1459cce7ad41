// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"

#include <trephine/voxel/convert.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace drill {

/// A volume of any type as the programs drill it: level = scale * density + offset.
struct LevelGrid {
  Grid grid;
  double scale = 1;
  double offset = 0;
};

/// Returns the grid in 16-bit levels: its own densities where they are whole or have a range of at least
/// `kFinestRange`, and fit; else spread over most of the levels, which moves the surface by less than their steps.
template <trephine::VoxelDensity Density>
[[nodiscard]] LevelGrid to_levels(const trephine::VoxelGrid<Density>& grid) {
  constexpr double kFinestRange = 1000;  // Hounsfield units have more; a hand does not feel a thousandth of the range
  constexpr double kSpread = 16000;      // to either side of 0
  const auto range = grid.original_range();
  const auto low = std::min(static_cast<double>(range.min), static_cast<double>(grid.outside()));
  const auto high = std::max(static_cast<double>(range.max), static_cast<double>(grid.outside()));
  const bool fits =
      low >= std::numeric_limits<std::int16_t>::lowest() && high <= std::numeric_limits<std::int16_t>::max();
  if (fits && (std::is_integral_v<Density> || high - low >= kFinestRange || high == low))
    return {trephine::converted<std::int16_t>(grid), 1, 0};
  const double scale = high > low ? 2 * kSpread / (high - low) : 1;
  const double offset = -kSpread - scale * low;
  return {trephine::converted<std::int16_t>(grid, scale, offset), scale, offset};
}

}  // namespace drill
