// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/bit_cast.hpp>
#include <trephine/core/host.hpp>

#include <cstdint>

/// Finiteness by bits: under -ffast-math compilers take std::isfinite for true and comparisons with NaN for either.
/// By reference, since such compilers may assume that no value that is passed is a NaN.
namespace trephine::inline TREPHINE_ALIGNED {

/// True unless v is NaN or infinite.
[[nodiscard]] constexpr bool is_finite(const double& v) noexcept {
  constexpr std::uint64_t kExponent = 0x7ff0'0000'0000'0000;
  return (detail::bit_cast<std::uint64_t>(v) & kExponent) != kExponent;
}
[[nodiscard]] constexpr bool is_finite(const float& v) noexcept {
  constexpr std::uint32_t kExponent = 0x7f80'0000;
  return (detail::bit_cast<std::uint32_t>(v) & kExponent) != kExponent;
}

/// True for NaN alone.
[[nodiscard]] constexpr bool is_nan(const double& v) noexcept {
  return (detail::bit_cast<std::uint64_t>(v) & 0x7fff'ffff'ffff'ffff) > 0x7ff0'0000'0000'0000;
}

}  // namespace trephine
