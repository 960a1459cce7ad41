// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>
#include <trephine/core/lane_loop.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

/// Packs comparisons of many SIMD lanes into the bits of an integer.
namespace trephine::inline TREPHINE_ALIGNED::detail {

/// An unsigned integer as wide as T, so that comparisons of T stay in one register width.
template <class T>
using LaneFlag =
    std::conditional_t<sizeof(T) == 1, std::uint8_t, std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint32_t>>;

/// Returns an integer whose bit l is set if predicate(l) holds, for 8 or 16 lanes. The predicate compares numbers of
/// type T.
template <class T, std::size_t kLanes, class Predicate>
[[nodiscard]] inline std::uint32_t lane_bits(Predicate&& predicate) noexcept {
  static_assert(kLanes == 8 || kLanes == 16);
  std::array<LaneFlag<T>, kLanes> wide;
  std::array<std::uint8_t, kLanes> flag;
  for_lanes<kLanes>([&](std::size_t l) { wide[l] = predicate(l) ? LaneFlag<T>{1} : LaneFlag<T>{0}; });
  for_lanes<kLanes>([&](std::size_t l) { flag[l] = static_cast<std::uint8_t>(wide[l]); });
  std::array<std::uint64_t, kLanes / 8> words;
  std::memcpy(words.data(), flag.data(), sizeof(flag));
  // Moves the lowest bit of byte i to bit 56 + i.
  constexpr std::uint64_t kGather =
      std::endian::native == std::endian::little ? 0x0102040810204080U : 0x8040201008040201U;
  std::uint32_t bits = 0;
  for (std::size_t w = 0; w < kLanes / 8; ++w) bits |= static_cast<std::uint32_t>(words[w] * kGather >> 56) << (8 * w);
  return bits;
}

/// Returns true if predicate(l) holds for any of 8 or 16 lanes.
template <class T, std::size_t kLanes, class Predicate>
[[nodiscard]] inline bool any_lane(Predicate&& predicate) noexcept {
  std::array<LaneFlag<T>, kLanes> flag;
  for_lanes<kLanes>([&](std::size_t l) { flag[l] = predicate(l) ? LaneFlag<T>{1} : LaneFlag<T>{0}; });
  std::array<std::uint64_t, sizeof(flag) / 8> words;
  std::memcpy(words.data(), flag.data(), sizeof(flag));
  std::uint64_t any = 0;
  for (const std::uint64_t word : words) any |= word;
  return any != 0;
}

}  // namespace trephine::detail
