// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Limits the magnitudes of force and torque to the device's range and keeps their directions. No stage may change the
/// wrench afterwards, so a scene accepts it only as its last stage. An omitted limit is infinite here; a servo loop
/// still applies the device's own limits. A device without motors for torque has a limit of zero.
///
/// `DeviceLimits{.force = 3.3, .torque = 0.1}` is an aggregate, so the scene's constructor calls `validate`. Results
/// never exceed a limit, not by rounding either. A non-finite wrench stays unchanged, and the scene then sends zero;
/// the same holds for a limit that became NaN later. No state. Haptic thread.
struct DeviceLimits {
  static constexpr bool kUsesTwist = false;
  using Options = DeviceLimits;

  double force = std::numeric_limits<double>::infinity();   ///< [N], >= 0
  double torque = std::numeric_limits<double>::infinity();  ///< [N·m], >= 0

  /// Throws std::invalid_argument if a limit is negative or NaN.
  void validate() const {
    if (!(force >= 0)) refuse("DeviceLimits", "force must be >= 0 N", force);
    if (!(torque >= 0)) refuse("DeviceLimits", "torque must be >= 0 N·m", torque);
  }
  /// Replaces the limits, which `validate` must accept; between ticks, haptic thread.
  void adopt(const DeviceLimits& options) noexcept { *this = options; }

  void apply(const TickContext&, Wrenchd& wrench) const noexcept {
    clamp(wrench.force, force);
    clamp(wrench.torque, torque);
  }

 private:
  /// Shortens a clamped vector by the error of four roundings, so that its norm never exceeds the limit.
  static constexpr double kRoundingMargin = 1 - 0x1p-50;

  /// Scales by the largest component first, so that squares of 1e200 or 1e-200 neither overflow nor vanish.
  static void clamp(Vec3d& v, double limit) noexcept {
    if (!is_finite(v)) return;
    const double largest = std::max({std::abs(v.x()), std::abs(v.y()), std::abs(v.z())});
    if (largest == 0) return;
    const Vec3d u = v / largest;
    const double norm = u.norm();
    if (largest * norm <= limit) return;
    v = u * (limit * kRoundingMargin / norm);
  }
};

}  // namespace trephine
