// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// Size of the surface elements of bone, along the axes of the grid.
///
/// At level 0 each crossed voxel edge has an element, cut into parts where voxels are longer along an axis. From level
/// 1 on there are points, joined in cells as near to cubes of 2ⁿ⁻¹ shortest spacings as powers of two of whole voxels
/// make them, and no larger.
struct ElementSize {
  static constexpr int kMaxLevel = 4;  ///< a cell is a brick at most
  static constexpr int kMaxParts = 8;  ///< parts of an element along an axis

  std::array<int, 3> joins{};         ///< log2 of the voxels of a cell along each axis
  std::array<int, 3> parts{1, 1, 1};  ///< of an element along each axis
  Vec3d cell = Vec3d::Ones();         ///< sides of a cell [m]
  double longest = 1;                 ///< longest side of a cell or a part, before the surface slants [m]

  /// `spacing` is the grid's [m]; `level` 0 to kMaxLevel.
  [[nodiscard]] static ElementSize at_level(const Vec3d& spacing, int level) noexcept {
    ElementSize size;
    const double shortest = spacing.minCoeff();
    size.longest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      const double h = spacing[axis];
      while (std::ldexp(h, size.joins[i] + 1) <= std::ldexp(kRounding * shortest, level - 1)) ++size.joins[i];
      if (level == 0) size.parts[i] = std::clamp(static_cast<int>(std::lround(h / shortest)), 1, kMaxParts);
      size.cell[axis] = std::ldexp(h, size.joins[i]);
      size.longest = std::max(size.longest, size.cell[axis] / size.parts[i]);
    }
    return size;
  }

 private:
  static constexpr double kRounding = 1 + 1e-6;
};

}  // namespace trephine
