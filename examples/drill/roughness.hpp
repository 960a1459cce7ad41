// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace drill {

/// Root mean square of what a signal of a thousand samples a second does faster than about 10 Hz: each sample less the
/// mean of the 51 round it.
[[nodiscard]] inline double roughness(const std::vector<trephine::Vec3d>& signal) {
  constexpr std::size_t kHalf = 25;
  if (signal.size() < 2 * kHalf + 1) return 0;
  double sum = 0;
  for (std::size_t i = kHalf; i + kHalf < signal.size(); ++i) {
    trephine::Vec3d mean = trephine::Vec3d::Zero();
    for (std::size_t j = i - kHalf; j <= i + kHalf; ++j) mean += signal[j] / (2 * kHalf + 1);
    sum += (signal[i] - mean).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(signal.size() - 2 * kHalf));
}

}  // namespace drill
