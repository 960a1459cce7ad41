// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace trephine::bench {

/// Rms of values less their mean over the last `window` of them; 0 without values.
[[nodiscard]] inline double ripple(const std::vector<double>& values, std::size_t window) {
  double near = 0, square = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    near += values[i] - (i >= window ? values[i - window] : 0);
    const double off = values[i] - near / static_cast<double>(std::min(i + 1, window));
    square += off * off;
  }
  return values.empty() ? 0 : std::sqrt(square / static_cast<double>(values.size()));
}

}  // namespace trephine::bench
