// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>

namespace trephine::inline TREPHINE_ALIGNED {

/// Replaces all lanes by their square roots, correctly rounded, so that every processor gives the same bits: Eigen's
/// own for floats begin with an estimate that Intel and AMD round differently. No std::sqrt in a loop, because it may
/// set errno, which prevents vectorisation. It works on 32 bytes at a time, as compilers do in the loops around it: a
/// wider load would have to wait for two narrower stores. So bits do not depend on the number of lanes. Always inline:
/// a call would store the lanes of the surrounding loops and load them again.
template <std::floating_point S, std::size_t kLanes>
[[gnu::always_inline]] inline void square_roots(std::array<S, kLanes>& x) noexcept {
  constexpr std::size_t kPart = std::min<std::size_t>(kLanes, 32 / sizeof(S));
  static_assert(kLanes % kPart == 0);
  for (std::size_t i = 0; i < kLanes; i += kPart) {
    S* part = x.data() + i;
    if constexpr (kPart == 1) {
      *part = std::sqrt(*part);
#ifdef EIGEN_VECTORIZE_AVX
    } else if constexpr (std::same_as<S, float> && kPart == 8) {
      _mm256_storeu_ps(part, _mm256_sqrt_ps(_mm256_loadu_ps(part)));
#endif
#ifdef EIGEN_VECTORIZE_SSE
    } else if constexpr (std::same_as<S, float> && kPart % 4 == 0) {
      for (std::size_t j = 0; j < kPart; j += 4) _mm_storeu_ps(part + j, _mm_sqrt_ps(_mm_loadu_ps(part + j)));
#endif
    } else {
      Eigen::Map<Eigen::Array<S, static_cast<int>(kPart), 1>> lanes(part);
      lanes = lanes.sqrt();
    }
  }
}

}  // namespace trephine
