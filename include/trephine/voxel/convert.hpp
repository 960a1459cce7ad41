// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <sstream>
#include <type_traits>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Returns a grid of other densities: `scale` times those of the source plus `offset`, rounded to the nearest in
/// integers. The isovalue is to be mapped likewise.
/// \code
/// auto bone = converted<std::int16_t>(mask, 1000);     // a mask of 0 and 1 at 0.5: now 0 and 1000 at 500
/// auto fine = converted<float>(bytes);                 // the same densities and isovalue
/// auto wide = converted<std::int16_t>(bytes, 8, -1000);
/// \endcode
/// A cut needs some densities on either side of the isovalue (`check_slope`), which masks do not have. A conversion
/// keeps the isosurface where it is. Size, spacing and pose stay; the densities are the present ones, cuts included.
///
/// Throws std::invalid_argument for a scale that is not finite and > 0, an offset that is not finite, and densities
/// that do not fit into the type. Any thread while no other one writes the grid.
template <VoxelDensity To, VoxelDensity From>
[[nodiscard]] VoxelGrid<To> converted(const VoxelGrid<From>& grid, double scale = 1, double offset = 0,
                                      const GridOptions& options = {}) {
  if (!(scale > 0) || !is_finite(scale)) refuse("converted", "scale must be > 0", scale);
  if (!is_finite(offset)) refuse("converted", "offset must be finite", offset);
  const auto convert = [&](From density) {
    const double exact = scale * static_cast<double>(density) + offset;
    const double v = std::is_floating_point_v<To> ? exact : std::floor(exact + 0.5);
    constexpr auto kLowest = static_cast<double>(std::numeric_limits<To>::lowest());
    constexpr auto kHighest = static_cast<double>(std::numeric_limits<To>::max());
    if (!(v >= kLowest && v <= kHighest)) {
      std::ostringstream rule;
      rule << "densities must fit into the type, from " << kLowest << " to " << kHighest;
      refuse("converted", rule.str(), v);
    }
    return static_cast<To>(v);
  };
  std::size_t count = 1;
  for (const int n : grid.size()) count *= static_cast<std::size_t>(n);
  std::vector<From> from(count);
  grid.copy_voxels(from);
  std::vector<To> to;
  to.reserve(count);
  for (const From density : from) to.push_back(convert(density));
  return {{.size = grid.size(),
           .spacing = grid.spacing(),
           .X_WG = grid.X_WG(),
           .outside = static_cast<double>(convert(grid.outside()))},
          std::span<const To>(to),
          options};
}

}  // namespace trephine
