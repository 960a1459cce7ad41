// SPDX-License-Identifier: MIT
// Square roots of lanes are those of std::sqrt, to the bit: IEEE 754 leaves no choice, whatever the processor.
#include <trephine/core/square_roots.hpp>

#include <doctest/doctest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

using namespace trephine;

namespace {

template <typename S, std::size_t kLanes>
int unequal(const std::array<S, kLanes>& x) {
  std::array<S, kLanes> roots = x;
  square_roots(roots);
  int n = 0;
  for (std::size_t i = 0; i < kLanes; ++i) n += roots[i] == std::sqrt(x[i]) ? 0 : 1;
  return n;
}

// Bits of each exponent and of many mantissas; the sign bit is left out.
template <std::size_t kLanes>
int unequal_floats(std::uint32_t first) {
  int n = 0;
  for (std::uint32_t bits = first; bits < 0x7f800000u - kLanes * 4099u;) {
    std::array<float, kLanes> x;
    for (float& of : x) of = std::bit_cast<float>(bits += 4099u);
    n += unequal(x);
  }
  return n;
}

}  // namespace

TEST_CASE("square roots: lanes are rounded as std::sqrt rounds") {
  CHECK(unequal_floats<1>(1) == 0);
  CHECK(unequal_floats<2>(2) == 0);
  CHECK(unequal_floats<4>(3) == 0);
  CHECK(unequal_floats<8>(5) == 0);
  CHECK(unequal_floats<16>(7) == 0);
  for (double x = 1e-308; x < 1e308; x *= 1.37) CHECK(unequal(std::array{x, 1.1 * x, 1.2 * x, 1.3 * x}) == 0);
}

TEST_CASE("square roots: nothing, the smallest, the largest and infinity") {
  using Limits = std::numeric_limits<float>;
  CHECK(unequal(std::array{0.f, Limits::denorm_min(), Limits::min(), Limits::max(), Limits::infinity(), 1.f,
                           Limits::epsilon(), 4.f}) == 0);
  std::array<float, 8> below{-1, -1, -1, -1, -1, -1, -1, -1};
  square_roots(below);
  for (const float x : below) CHECK(std::isnan(x));
}
