// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <Eigen/Core>

#include <array>
#include <cstddef>

namespace trephine::inline TREPHINE_ALIGNED {

/// Returns the sum of all lanes, in the same order on every processor. It loads 32 bytes at a time, as compilers store
/// them in the loops around it: a wider load would have to wait for two narrower stores.
template <std::size_t kLanes>
[[nodiscard]] inline double lane_sum(const std::array<double, kLanes>& x) noexcept {
  constexpr std::size_t kPart = 4;
  static_assert(kLanes % kPart == 0);
  using Part = Eigen::Array<double, kPart, 1>;
  Part sum = Eigen::Map<const Part>(x.data());
  for (std::size_t i = kPart; i < kLanes; i += kPart) sum += Eigen::Map<const Part>(x.data() + i);
  return sum.sum();
}

}  // namespace trephine
