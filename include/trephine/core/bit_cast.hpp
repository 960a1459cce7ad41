// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {
namespace detail {

/// std::bit_cast, which libc++ lacks before its version 14, as in Debian 12's Emscripten. GCC, clang and MSVC have the
/// builtin.
template <class To, class From>
  requires(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>)
[[nodiscard]] constexpr To bit_cast(const From& from) noexcept {
  return __builtin_bit_cast(To, from);
}

}  // namespace detail
}  // namespace trephine
