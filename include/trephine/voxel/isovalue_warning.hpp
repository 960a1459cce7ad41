// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <sstream>
#include <string>

namespace trephine::inline TREPHINE_ALIGNED {

/// Returns a sentence for the developer if an isovalue finds no surface in an image, as in other units or another
/// window: if no density at construction reaches it, so that nothing will ever be felt, or if all densities and what
/// is outside do, so that a tool is in bone wherever it is. An empty string otherwise. Any thread.
///
/// It is no mistake to throw for: programs and tests make grids of air, and load images that were drilled away.
template <VoxelDensity Density>
[[nodiscard]] std::string isovalue_warning(const VoxelGrid<Density>& grid, double isovalue) {
  const auto min = static_cast<double>(grid.original_range().min), max = static_cast<double>(grid.original_range().max);
  const auto outside = static_cast<double>(grid.outside());
  const bool is_air = max < isovalue && outside < isovalue, is_bone = min >= isovalue && outside >= isovalue;
  if (!is_air && !is_bone) return {};
  std::ostringstream s;
  s << "the isovalue " << isovalue << (is_air ? " lies above" : " lies at or below")
    << " every density of the grid, from " << min << " to " << max << " and " << outside
    << " outside: " << (is_air ? "there is no bone to feel" : "all is bone, and no tool can leave it");
  return s.str();
}

}  // namespace trephine
