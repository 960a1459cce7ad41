// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <numbers>

/// Literals for lengths, in metres: `1.5_mm` is 0.0015. Speeds in turns a minute: `rpm(1000)` is 104.7 rad/s.
namespace trephine::inline TREPHINE_ALIGNED {
inline namespace literals {

constexpr double operator""_m(long double v) { return static_cast<double>(v); }
constexpr double operator""_m(unsigned long long v) { return static_cast<double>(v); }
constexpr double operator""_mm(long double v) { return static_cast<double>(v / 1000.0L); }
constexpr double operator""_mm(unsigned long long v) {
  return static_cast<double>(static_cast<long double>(v) / 1000.0L);
}
constexpr double operator""_um(long double v) { return static_cast<double>(v / 1.0e6L); }
constexpr double operator""_um(unsigned long long v) {
  return static_cast<double>(static_cast<long double>(v) / 1.0e6L);
}

}  // namespace literals

/// Spindle speed in turns a minute, as radians a second.
[[nodiscard]] constexpr double rpm(double turns) noexcept { return turns * 2 * std::numbers::pi / 60; }

}  // namespace trephine
