// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/tolerances.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Finds out that a tool stays where no hand would work: poses are then likely in millimetres, or the bone is not where
/// the device is. Haptic thread.
class FarAway {
 public:
  /// Returns true once the tool's origin `p_G` [m, G] has been farther than `kFarthestHand` from the grid for
  /// `kFarTime`; `dt` [s] is the time since the last call.
  template <class Grid>
  [[nodiscard]] bool is_far(const Grid& grid, const Vec3d& p_G, double dt) noexcept {
    const Vec3d extent = grid.spacing().cwiseProduct(Vec3d(grid.size()[0], grid.size()[1], grid.size()[2]));
    const Vec3d outside = p_G - p_G.cwiseMax(0.0).cwiseMin(extent);
    far_time_ = outside.squaredNorm() > kFarthestHand * kFarthestHand ? far_time_ + dt : 0;
    return far_time_ >= kFarTime;
  }

 private:
  double far_time_ = 0;  // [s]
};

}  // namespace trephine
