// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

/// Checks of a grid's geometry that every grid of voxels shares. Construction and editing call them; a tick never does.
namespace trephine::inline TREPHINE_ALIGNED {

// Numbers that decide which input is refused.
inline constexpr double kMinGridSpacing = 1e-9;  // [m] single precision can still invert it
inline constexpr int kMaxGridSize = 1 << 20;     // [voxels] along an axis; keeps products of sizes within 64 bits

namespace detail {

/// Throws std::invalid_argument unless `X` holds a right-handed rotation within kRotationTolerance and lies within
/// kFarthestPosition. `type` and `name` are those of the grid and its pose, for the message.
inline void check_grid_pose(std::string_view type, const std::string& name, const Posed& X) {
  const Mat3d R = X.linear();
  const double off = rotation_defect(R);
  if (!is_finite(R) || !(off <= kRotationTolerance) || !(R.determinant() > 0))
    refuse(type, name + " must hold a right-handed rotation", off);
  if (!is_finite(X) || !(X.translation().norm() <= kFarthestPosition))
    refuse(type, name + " must lie within 1 km of the origin", X.translation().norm());
}

/// Throws std::invalid_argument unless size, spacing and pose are in range and the buffer holds `buffered` voxels.
inline void check_grid(std::string_view type, const std::string& pose_name, const GridGeometry& geometry,
                       std::size_t buffered) {
  std::int64_t count = 1;
  std::int64_t padded = 1;
  for (const int n : geometry.size) {
    if (!(n >= 1)) refuse(type, "each size must be >= 1 voxel", n);
    if (n > kMaxGridSize) refuse(type, "each size must be at most 2^20 voxels", n);
    count *= n;
    padded *= n + 4;
    // 32-bit voxel indices: the sampling kernel then has one vector register per lane.
    if (padded > std::numeric_limits<std::int32_t>::max()) refuse(type, "at most 2^31 voxels fit", padded);
  }
  for (int a = 0; a < 3; ++a) {
    const double spacing = geometry.spacing[a];
    if (!(spacing > 0)) refuse(type, "spacing must be > 0 m", spacing);
    if (!(spacing >= kMinGridSpacing)) refuse(type, "spacing must be at least 1 nm", spacing);
    refuse_beyond(type, "spacing", kLargestSpacing, spacing);
  }
  check_grid_pose(type, pose_name, geometry.X_WG);
  if (static_cast<std::int64_t>(buffered) != count)
    refuse(type, "the buffer must hold " + std::to_string(count) + " voxels", buffered);
}

}  // namespace detail

}  // namespace trephine
