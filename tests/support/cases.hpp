// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

namespace trephine::test {

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized = __has_feature(address_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

/// Number of cases of a statistical test: all `n`, or an eighth under the address sanitizer, which takes ten times as
/// long and searches for faults of memory, not for figures. At least 2.
[[nodiscard]] constexpr int cases(int n) noexcept { return kSanitized ? std::max(2, n / 8) : n; }

}  // namespace trephine::test
