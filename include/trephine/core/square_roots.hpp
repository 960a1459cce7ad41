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

/// Replaces all lanes by their square roots. Eigen does it, because std::sqrt may set errno, which prevents
/// vectorisation. It works on 32 bytes at a time, as compilers do in the loops around it: a wider load would have to
/// wait for two narrower stores. So bits do not depend on the number of lanes. Always inline: a call would store the
/// lanes of the surrounding loops and load them again.
template <std::floating_point S, std::size_t kLanes>
[[gnu::always_inline]] inline void square_roots(std::array<S, kLanes>& x) noexcept {
  constexpr std::size_t kPart = std::min<std::size_t>(kLanes, 32 / sizeof(S));
  static_assert(kLanes % kPart == 0);
  if constexpr (kLanes == 1) {
    x[0] = std::sqrt(x[0]);
  } else {
    for (std::size_t i = 0; i < kLanes; i += kPart) {
      Eigen::Map<Eigen::Array<S, static_cast<int>(kPart), 1>> lanes(x.data() + i);
      lanes = lanes.sqrt();
    }
  }
}

}  // namespace trephine
