// SPDX-License-Identifier: MIT
#pragma once

/// Arguments that fit nothing, and how they end in one sentence instead of in a list of what they do not fit.
namespace trephine::detail {

/// A deduction guide for what no other takes makes the class of this: its primary template asserts what to write.
template <class... Arguments>
struct Misused {};

/// A renderer that an assertion has spoken of already.
struct UnusableRenderer {};

/// False, but not before it is asked for.
template <class...>
inline constexpr bool kFits = false;

}  // namespace trephine::detail
