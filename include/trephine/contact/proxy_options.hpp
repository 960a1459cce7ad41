// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>

#include <optional>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a surface proxy: search steps and work limits.
struct ProxyOptions {
  double step = 0.5;  ///< largest tangential move and largest search step, in voxels
  /// Tangential moves per tick, in addition to those of a straight slide (at most 8 times as many).
  int iterations = 16;
  int path_steps = 512;  ///< samples along a path; a longer path gets longer steps
  /// Largest motion of the probe between two ticks [m]: 5 m/s at 1 kHz, beyond any hand. After a longer motion contact
  /// is reset, because a proxy left behind would pull the hand across the gap.
  double jump = 0.005;
  /// Longest way of the proxy along the surface over the probe's way. A bound makes a proxy drop off an edge gradually;
  /// it then lags behind, and energy is lost. Without it the proxy slides on at once.
  std::optional<double> slide{};

  /// Throws std::invalid_argument for a number outside its range.
  void validate() const {
    if (!(step > 0 && step <= 4)) refuse("ProxyOptions", "step must be > 0 and at most 4 voxels", step);
    if (!(iterations >= 1 && iterations <= 1000)) refuse("ProxyOptions", "iterations must be 1 to 1000", iterations);
    if (!(path_steps >= 8 && path_steps <= 100000))
      refuse("ProxyOptions", "path_steps must be 8 to 100000", path_steps);
    if (!(jump > 0)) refuse("ProxyOptions", "jump must be > 0 m", jump);
    if (slide && !(*slide >= 1)) refuse("ProxyOptions", "slide must be >= 1", *slide);
  }
};

}  // namespace trephine
