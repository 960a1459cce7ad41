// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/any_cut.hpp>

namespace trephine::bench {

enum class Cut { kAtOnce, kByRate, kAdvancing };

/// The cut of a kind; `rate` in densities a second, `speed` in m/s.
[[nodiscard]] inline AnyCut cut_of(Cut cut, double rate, double speed) {
  if (cut == Cut::kAtOnce) return GeometricCut{};
  if (cut == Cut::kByRate) return RateLimitedCut<>{.rate = rate};
  return AdvancingCut{.speed = speed};
}

}  // namespace trephine::bench
