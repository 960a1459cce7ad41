// SPDX-License-Identifier: MIT
#pragma once

#include "workbench.hpp"

#include <cstdint>
#include <vector>

namespace live {

/// Where a session ends that was played in simulated time.
struct Simulated {
  double removed_mm3 = 0;
  Vec3d force = Vec3d::Zero();  ///< of the last tick, on the tool, in W [N]
  std::uint64_t ticks = 0;
  double most_second_N = 0;   ///< that the second hand felt
  double tick_us_median = 0;  ///< wall time of a tick in the scene [µs]
};

/// Plays a session's events on this thread, as fast as it can, without a picture. Events come at frames of 60 Hz, as
/// in a window. Two runs of one binary end alike. Throws std::exception as `Workbench`.
[[nodiscard]] Simulated simulate(Loaded loaded, const LiveOptions& options, std::vector<Event> events);

}  // namespace live
