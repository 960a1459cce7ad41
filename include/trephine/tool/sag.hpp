// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Returns the square [m²] that over r is how far the trilinear surface of a ball of radius r lies inside it, as a tool
/// in its own hole feels it. `mean` is the square over that of a cell's diagonal, in isotropic voxels.
///
/// A contact is as wide as some of the shortest voxels. So in isotropic voxels it feels a mean over cells that sag in
/// some directions and not in others. Along an axis with longer voxels it lies within a cell, and feels what chords of
/// the length h sag there: h²/8r in their middle, and two thirds of that on the mean.
[[nodiscard]] inline double sag_square(const Vec3d& spacing, double mean) noexcept {
  constexpr double kChord = 1.0 / 12;
  double square = 0;
  for (const double h : spacing) {
    const double isotropy = spacing.minCoeff() / h;
    square += h * h * ((1 - isotropy) * kChord + isotropy * mean);
  }
  return square;
}

}  // namespace trephine
