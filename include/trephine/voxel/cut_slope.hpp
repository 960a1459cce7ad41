// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <limits>
#include <type_traits>

/// Slope of a cut: how fast densities rise with the distance from the cutter.
namespace trephine::inline TREPHINE_ALIGNED {

/// Slope of a cut over that of the image at its own surface, by default.
///
/// Where the new surface meets the old one, an interpolant between both is exact only if both are as steep. A shallower
/// cut draws the old surface in beside the hole, by up to a voxel. Bone that is softer than the ramp is high cannot
/// hold it, and is cut too far by a steep one. Bone removed, off what it should be (`tests/voxel/surface_slopes.cpp`):
/// | slope over the image's own | 1/16 | 1/4 | 1/2 | 1 | 4 |
/// |---|---|---|---|---|---|
/// | balls at planes, median | 12 % | 5 % | 1.3 % | .2 % | 9 % |
/// | in bone of a quarter of hard bone's contrast | 0 | 0 | 1.7 % | 8 % | 21 % |
inline constexpr double kSteepness = 0.5;

/// Fewest densities a voxel of a cut in integers. Rounding then displaces the surface by a 20th of a voxel at most, and
/// a burr of 20 voxels radius rests in its own hole with 0.04 N. With 1 density it stays behind by voxels
/// (`tests/render/coupled_own_hole.cpp`).
inline constexpr double kFewestDensities = 10;

/// Returns a cut's default slope, in densities per (longest) voxel edge: kSteepness times that of the image at its own
/// surface, and no more than the densities above the isovalue. The ramp beside the cutter would else end in the bone,
/// and the hole would be too large.
///
/// In integers it is 16 at least, because rounding to whole densities displaces the surface by up to 1/(2 slope) voxel.
/// It is less if the range has no 16 densities above the isovalue or below it. An image without a surface gets 1/64 of
/// the range above the isovalue, or 16.
template <VoxelDensity Density>
[[nodiscard]] double auto_slope(const VoxelGrid<Density>& grid, double isovalue) noexcept {
  const double above = static_cast<double>(grid.original_range().max) - isovalue;
  const double own = kSteepness * grid.surface_slope(isovalue), slope = own > 0 ? own : above / 64;
  if constexpr (std::is_floating_point_v<Density>) {
    if (!(slope > 0)) return 1;
    return above > 0 ? std::min(slope, above) : slope;
  } else {
    const double below = isovalue - static_cast<double>(std::numeric_limits<Density>::lowest());
    return std::max(std::min({above, below, std::max(16.0, slope)}), 4.0);
  }
}

/// Returns the requested slope if it is one, else the automatic slope.
template <VoxelDensity Density>
[[nodiscard]] double slope_or_auto(double slope, const VoxelGrid<Density>& grid, double isovalue) noexcept {
  return slope > 0 && is_finite(slope) ? slope : auto_slope(grid, isovalue);
}

/// Throws std::invalid_argument if a cut of this slope (0: `auto_slope`) makes no hole that its own tool fits: in
/// integers, fewer than kFewestDensities a voxel, as its slope or as there is room above or below the isovalue. So
/// masks of 0 and 1 are refused. The way out is `converted` (convert.hpp). Floats have room, and a grid that does not
/// reach the isovalue has nothing to cut.
template <VoxelDensity Density>
void check_slope(const VoxelGrid<Density>& grid, double isovalue, double slope) {
  if constexpr (!std::is_floating_point_v<Density>) {
    const double above = static_cast<double>(grid.original_range().max) - isovalue;
    const double below = isovalue - static_cast<double>(std::numeric_limits<Density>::lowest());
    const double used = std::min({slope_or_auto(slope, grid, isovalue), above, below});
    if (above < 0 || used >= kFewestDensities) return;
    refuse(
        "Milling",
        "a tool fits a hole in whole densities only with 10 or more of them above the isovalue, below it, and in the "
        "slope: cut converted<float>(grid), or multiply densities and isovalue, as in "
        "converted<std::int16_t>(grid, 1000)",
        used);
  }
}

}  // namespace trephine
