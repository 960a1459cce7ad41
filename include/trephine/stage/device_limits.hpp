// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trephine {

/// What the device can give: the magnitudes of force and torque are cut to the limits, their directions kept. Nothing
/// may change the wrench after it, so a scene accepts it only as its last stage. What is not given is not limited here;
/// a servo loop keeps it within the device's own means. A device without motors for torque has a limit of zero.
///
/// `DeviceLimits{.force = 3.3, .torque = 0.1}`; an aggregate, so it is the scene's constructor that calls `validate`.
/// Results never exceed a limit, not by rounding either. A non-finite wrench is left as it is, for the scene to see
/// and to answer by zero; so is one that meets a limit which became NaN later. No state. Haptic thread.
struct DeviceLimits {
  static constexpr bool kUsesTwist = false;
  using Options = DeviceLimits;

  double force = std::numeric_limits<double>::infinity();   ///< [N], >= 0
  double torque = std::numeric_limits<double>::infinity();  ///< [N·m], >= 0

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(force >= 0)) refuse("DeviceLimits", "force must be >= 0 N", force);
    if (!(torque >= 0)) refuse("DeviceLimits", "torque must be >= 0 N·m", torque);
  }
  /// Takes limits that `validate` accepted; between ticks, haptic thread.
  void adopt(const DeviceLimits& options) noexcept { *this = options; }

  void apply(const TickContext&, Wrenchd& wrench) const noexcept {
    clamp(wrench.force, force);
    clamp(wrench.torque, torque);
  }

 private:
  /// Scaled by the largest component first: squares of 1e200 or 1e-200 neither overflow nor vanish.
  static void clamp(Vec3d& v, double limit) noexcept {
    constexpr double kBelow = 1 - 0x1p-50;  // four roundings' room
    if (!is_finite(v)) return;
    const double largest = std::max({std::abs(v.x()), std::abs(v.y()), std::abs(v.z())});
    if (largest == 0) return;
    const Vec3d u = v / largest;
    const double norm = u.norm();
    if (largest * norm <= limit) return;
    v = u * (limit * kBelow / norm);
  }
};

}  // namespace trephine
