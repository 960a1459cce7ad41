// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

/// Comparisons of many lanes as bits of a number.
namespace trephine::detail {

/// As wide as T, so that comparisons of T stay in one register width.
template <class T>
using LaneFlag =
    std::conditional_t<sizeof(T) == 1, std::uint8_t, std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint32_t>>;

/// Bit l is set where is(l), in 8 or 16 lanes; `is` compares numbers of type T.
template <class T, std::size_t kLanes, class Is>
[[nodiscard]] inline std::uint32_t lane_bits(Is&& is) noexcept {
  static_assert(kLanes == 8 || kLanes == 16);
  std::array<LaneFlag<T>, kLanes> wide;
  std::array<std::uint8_t, kLanes> flag;
  for (std::size_t l = 0; l < kLanes; ++l) wide[l] = is(l) ? LaneFlag<T>{1} : LaneFlag<T>{0};
  for (std::size_t l = 0; l < kLanes; ++l) flag[l] = static_cast<std::uint8_t>(wide[l]);
  std::array<std::uint64_t, kLanes / 8> words;
  std::memcpy(words.data(), flag.data(), sizeof(flag));
  // Moves the lowest bit of byte i to bit 56 + i.
  constexpr std::uint64_t kGather =
      std::endian::native == std::endian::little ? 0x0102040810204080U : 0x8040201008040201U;
  std::uint32_t bits = 0;
  for (std::size_t w = 0; w < kLanes / 8; ++w) bits |= static_cast<std::uint32_t>(words[w] * kGather >> 56) << (8 * w);
  return bits;
}

/// Whether is(l) anywhere, in 8 or 16 lanes.
template <class T, std::size_t kLanes, class Is>
[[nodiscard]] inline bool any_lane(Is&& is) noexcept {
  std::array<LaneFlag<T>, kLanes> flag;
  for (std::size_t l = 0; l < kLanes; ++l) flag[l] = is(l) ? LaneFlag<T>{1} : LaneFlag<T>{0};
  std::array<std::uint64_t, sizeof(flag) / 8> words;
  std::memcpy(words.data(), flag.data(), sizeof(flag));
  std::uint64_t any = 0;
  for (const std::uint64_t word : words) any |= word;
  return any != 0;
}

}  // namespace trephine::detail
