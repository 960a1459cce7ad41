// SPDX-License-Identifier: MIT
#pragma once

/// Literals for lengths, in metres: `1.5_mm` is 0.0015.
namespace trephine {
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
}  // namespace trephine
