// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Twice what a hand reaches in a free swing [m/s].
inline constexpr double kFastestHandle = 5;
/// What a reading may be off besides: noise, and intervals that the clock blurs [m].
inline constexpr double kHandleNoise = 0.005;

/// Returns true if no hand moves a handle from one reading to the next in an interval [s]: the device's readings cannot
/// be believed. Also for places that are not finite.
[[nodiscard]] inline bool leaps(const Vec3d& from, const Vec3d& to, double interval) noexcept {
  return !((to - from).norm() <= kHandleNoise + kFastestHandle * interval);
}

}  // namespace trephine
