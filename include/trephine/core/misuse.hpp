// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

/// Compile-time diagnostics: a wrong template argument list ends in one readable static_assert message.
namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Result of a catch-all deduction guide. The primary template for this type asserts the correct spelling.
template <class... Arguments>
struct Misused {};

/// Base of a renderer that a static_assert has already reported. A scene suppresses further errors about it.
struct UnusableRenderer {};

/// False for every argument list, but only once it is instantiated.
template <class...>
inline constexpr bool kFits = false;

}  // namespace trephine::detail
