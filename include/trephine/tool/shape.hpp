// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>

#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// A round burr: a ball at T's origin and a cylindrical shaft along +z. Lengths are in metres, and radii are not
/// diameters.
struct Burr {
  double tip_radius = 0.0015;    ///< of the ball [m]
  double shaft_radius = 0.0008;  ///< [m]
  double shaft_length = 0.040;   ///< from the ball's centre to the shaft's end [m]; 0: no shaft

  [[nodiscard]] bool has_shaft() const noexcept { return shaft_length > 0; }

  /// Height above the ball's centre at which the shaft's surface leaves the ball [m].
  [[nodiscard]] double shaft_emerges() const noexcept {
    const double d2 = tip_radius * tip_radius - shaft_radius * shaft_radius;
    return d2 > 0 ? std::sqrt(d2) : 0.0;
  }

  /// Throws std::invalid_argument unless radii are in (0, kLargestRadius] and the shaft, if any, is longer than the
  /// ball's radius and at most kLongestShaft.
  void validate() const {
    const auto positive = [](double v) { return v > 0 && is_finite(v); };
    if (!positive(tip_radius)) refuse("Burr", "tip_radius must be > 0 m", tip_radius);
    refuse_beyond("Burr", "tip_radius", kLargestRadius, tip_radius);
    if (!(shaft_length >= 0) || !is_finite(shaft_length)) refuse("Burr", "shaft_length must be >= 0 m", shaft_length);
    refuse_beyond("Burr", "shaft_length", kLongestShaft, shaft_length);
    if (!has_shaft()) return;
    if (!positive(shaft_radius)) refuse("Burr", "shaft_radius must be > 0 m", shaft_radius);
    refuse_beyond("Burr", "shaft_radius", kLargestRadius, shaft_radius);
    if (!(shaft_length > tip_radius))
      refuse("Burr", "shaft_length must exceed tip_radius (or be 0: no shaft)", shaft_length);
  }
};

/// A burr whose ball cuts, larger than the tool's by an allowance.
struct CuttingBall : Burr {
  double allowance = 0;  ///< by which `tip_radius` exceeds the tool's [m]
};

}  // namespace trephine
