// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <cstddef>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Calls body(l) for lanes 0 to kLanes − 1, so that the loop is vectorised.
///
/// GCC unrolls a short loop where it stands in another one before it vectorises, and then works lane by lane, unless it
/// is told not to.
template <std::size_t kLanes, class Body>
inline void for_lanes(Body&& body) noexcept {
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC unroll 1
#endif
  for (std::size_t l = 0; l < kLanes; ++l) body(l);
}

}  // namespace trephine::detail
