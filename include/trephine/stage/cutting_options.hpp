// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a `Cutting` that do not depend on its policy.
struct CuttingOptions {
  double slope = 0;           ///< of the cut [densities per voxel]; 0: auto_slope
  bool follow_probe = false;  ///< cut along the device's pose instead of the renderer's cutting pose
  /// Blocks of 16 voxels that a tick cuts, about: a tool that crosses more cuts the bone in turns (`CutTurn`), a turn
  /// a tick, `CutTurn::kMost` at most. A burr crosses π r² (1 + r/16), r its radius in voxels.
  int blocks = 700;

  /// Throws std::invalid_argument.
  void validate() const {
    if (blocks < 1) refuse("Cutting", "blocks must be at least 1", blocks);
    if (!(slope >= 0) || !is_finite(slope)) refuse("Cutting", "slope must be >= 0 densities per voxel", slope);
  }
  friend bool operator==(const CuttingOptions&, const CuttingOptions&) = default;
};

}  // namespace trephine
