// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/tick_bytes.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

/// Ticks in fewer bytes, without loss of a bit. A tick's bytes (`tick_bytes.hpp`) are words of 64 bits, and each is
/// stored as its difference from the same word of the tick before: sign in the lowest bit, without the zero bytes at
/// its top. Neighbours share sign, exponent and first digits, so these bytes are zero. A packed tick: half a byte for
/// the number of bytes of each word, lower half first; then the bytes of all words, lowest first.
namespace trephine::inline TREPHINE_ALIGNED::session_detail {

inline constexpr std::size_t kTickWords = recording_detail::kTickBytes / 8;
static_assert(recording_detail::kTickBytes % 16 == 0, "half a byte for each word fills whole bytes");
inline constexpr std::size_t kLengthBytes = kTickWords / 2;

/// The words of the tick before; zeros at first, as at the start of each chunk of a file.
using TickWords = std::array<std::uint64_t, kTickWords>;

/// Appends the tick to `out`, and makes it the one before.
inline void pack_tick(std::string& out, std::string& scratch, TickWords& before, const RecordedTick& tick) {
  scratch.clear();
  recording_detail::put_tick(scratch, tick);
  const std::size_t lengths = out.size();
  out.append(kLengthBytes, '\0');
  for (std::size_t w = 0; w < kTickWords; ++w) {
    std::uint64_t word;
    std::memcpy(&word, scratch.data() + 8 * w, 8);
    const std::uint64_t difference = word - before[w];
    before[w] = word;
    std::uint64_t rest = (difference << 1) ^ (0 - (difference >> 63));
    const int bytes = (static_cast<int>(std::bit_width(rest)) + 7) / 8;
    char& length = out[lengths + w / 2];
    length = static_cast<char>(static_cast<unsigned char>(length) | bytes << (w % 2 * 4));
    for (int b = 0; b < bytes; ++b, rest >>= 8) out.push_back(static_cast<char>(rest & 0xff));
  }
}

/// Takes a tick from the front of `in`. Returns false if there is none: `in` is too short, or a length is no length.
[[nodiscard]] inline bool unpack_tick(std::string_view& in, TickWords& before, RecordedTick& tick) {
  if (in.size() < kLengthBytes) return false;
  std::size_t at = kLengthBytes;
  std::array<char, recording_detail::kTickBytes> bytes{};
  for (std::size_t w = 0; w < kTickWords; ++w) {
    const std::size_t length = static_cast<unsigned char>(in[w / 2]) >> (w % 2 * 4) & 0xfU;
    if (length > 8 || in.size() - at < length) return false;
    std::uint64_t packed = 0;
    for (std::size_t b = 0; b < length; ++b)
      packed |= static_cast<std::uint64_t>(static_cast<unsigned char>(in[at + b])) << (8 * b);
    at += length;
    before[w] += (packed >> 1) ^ (0 - (packed & 1));
    std::memcpy(bytes.data() + 8 * w, &before[w], 8);
  }
  in.remove_prefix(at);
  recording_detail::Cursor cursor(bytes.data());
  tick = recording_detail::take_tick(cursor, recording_detail::kVersion);
  return true;
}

}  // namespace trephine
