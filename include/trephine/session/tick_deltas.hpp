// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/rice_code.hpp>
#include <trephine/session/tick_bytes.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

/// Ticks in fewer bytes, without loss of a bit. A tick's bytes (`tick_bytes.hpp`) are words of 64 bits, and each is
/// stored as its difference from a guess, sign in the lowest bit. The guess is the same word of the tick before, since
/// neighbours share sign, exponent and first digits. The rotation's third column is guessed from the other two.
///
/// A packed tick is these differences in Rice's code (`rice_code.hpp`), each word with a code of its own, which starts
/// anew with each chunk of a file; the last byte is filled with zeros.
///
/// In files of version 1 it is a row of digits of 4 bits, the lower half of a byte first. First, for each word, the
/// number of its digits; 15 stands for 16. Then the digits of all words, lowest first, and a 0 if their number is odd.
namespace trephine::inline TREPHINE_ALIGNED::session_detail {

inline constexpr std::size_t kTickWords = recording_detail::kTickBytes / 8;
static_assert(recording_detail::kTickBytes % 16 == 0, "a tick is words, and in version 1 their lengths fill bytes");

/// The words of a tick. Those before the first are zeros, as at the start of each chunk of a file.
using TickWords = std::array<std::uint64_t, kTickWords>;
[[nodiscard]] inline RecordedTick tick_of(const TickWords& words) {
  std::array<char, recording_detail::kTickBytes> bytes{};
  std::memcpy(bytes.data(), words.data(), bytes.size());
  recording_detail::Cursor cursor(bytes.data());
  return recording_detail::take_tick(cursor, recording_detail::kVersion);
}

/// A number of (-2, 2) in 2^-61, from the bits of a double; none for others. Smaller parts are cut off.
[[nodiscard]] constexpr std::optional<std::int64_t> fixed_point(std::uint64_t bits) noexcept {
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff);
  if (exponent > 1023) return std::nullopt;
  const int shift = exponent - 1014;
  const std::uint64_t digits = (bits & 0xf'ffff'ffff'ffff) | std::uint64_t{1} << 52;
  const std::uint64_t size = shift >= 0 ? digits << shift : shift > -64 ? digits >> -shift : 0;
  return bits >> 63 != 0 ? -static_cast<std::int64_t>(size) : static_cast<std::int64_t>(size);
}
/// The product of two of these, in 2^-60.
[[nodiscard]] constexpr std::int64_t fixed_product(std::int64_t a, std::int64_t b) noexcept {
  constexpr std::uint64_t kLow = (std::uint64_t{1} << 31) - 1;
  const auto x = static_cast<std::uint64_t>(a < 0 ? -a : a), y = static_cast<std::uint64_t>(b < 0 ? -b : b);
  const std::uint64_t middle = (x >> 31) * (y & kLow) + (x & kLow) * (y >> 31);
  const auto size = static_cast<std::int64_t>((x >> 31) * (y >> 31) + (middle >> 31));
  return (a < 0) != (b < 0) ? -size : size;
}
/// The bits of a double of this many 2^-60; digits beyond a double's are cut off.
[[nodiscard]] constexpr std::uint64_t double_bits(std::int64_t fixed) noexcept {
  if (fixed == 0) return 0;
  const std::uint64_t sign = fixed < 0 ? std::uint64_t{1} << 63 : 0;
  const auto size = static_cast<std::uint64_t>(fixed < 0 ? -fixed : fixed);
  const int width = static_cast<int>(std::bit_width(size));
  const std::uint64_t digits = width > 53 ? size >> (width - 53) : size << (53 - width);
  return sign | static_cast<std::uint64_t>(1022 - 60 + width) << 52 | (digits & 0xf'ffff'ffff'ffff);
}

/// The guess of word `w`, from the words before it in this tick and those of the tick before. In integers, because
/// writer and reader must agree in every bit, whatever their compilers fuse and their hosts' modes round or flush.
[[nodiscard]] constexpr std::uint64_t guessed_word(const TickWords& now, const TickWords& before, std::size_t w) {
  if (w < 6 || w > 8) return before[w];
  const std::size_t i = (w - 5) % 3, j = (w - 4) % 3;  // the third column is the cross product of the others
  const auto a = fixed_point(now[i]), b = fixed_point(now[3 + j]);
  const auto c = fixed_point(now[j]), d = fixed_point(now[3 + i]);
  if (!a || !b || !c || !d) return before[w];
  return double_bits(fixed_product(*a, *b) - fixed_product(*c, *d));
}

/// [bytes] of a packed tick whose words all take the code's longest, 14 bits and 63 of their own.
inline constexpr std::size_t kLargestTick = kTickWords * (14 + 63) / 8 + 1;

/// Packs ticks of one chunk, or unpacks them.
class TickPacker {
 public:
  /// Appends the tick to `out`.
  void pack(std::string& out, const RecordedTick& tick) {
    scratch_.clear();
    recording_detail::put_tick(scratch_, tick);
    TickWords now;
    std::memcpy(now.data(), scratch_.data(), recording_detail::kTickBytes);
    BitWriter bits(out);
    for (std::size_t w = 0; w < kTickWords; ++w) codes_[w].put(bits, folded(now[w] - guessed_word(now, before_, w)));
    before_ = now;
  }
  /// Takes a tick from the front of `in`. Returns false if there is none: `in` is too short.
  [[nodiscard]] bool unpack(std::string_view& in, RecordedTick& tick) {
    BitReader bits(in);
    TickWords now{};
    for (std::size_t w = 0; w < kTickWords; ++w)
      now[w] = guessed_word(now, before_, w) + unfolded(codes_[w].take(bits));
    if (bits.is_short()) return false;
    in.remove_prefix(bits.bytes());
    before_ = now;
    tick = tick_of(now);
    return true;
  }
  /// Forgets all ticks, as at the start of a chunk.
  void restart() noexcept {
    before_ = {};
    codes_ = {};
  }

 private:
  TickWords before_{};
  std::array<RiceCode, kTickWords> codes_{};
  std::string scratch_;
};

/// Takes a tick of version 1 from the front of `in`; `before` are the words of the one before. Returns false if there
/// is none: `in` is too short.
[[nodiscard]] inline bool unpack_tick_1(std::string_view& in, TickWords& before, RecordedTick& tick) {
  constexpr std::size_t kLengthBytes = kTickWords / 2;
  if (in.size() < kLengthBytes) return false;
  const auto digit = [&in](std::size_t at) {
    return static_cast<std::uint64_t>(static_cast<unsigned char>(in[at / 2])) >> (at % 2 * 4) & 0xf;
  };
  std::size_t at = kTickWords;
  TickWords now{};
  for (std::size_t w = 0; w < kTickWords; ++w) {
    const std::size_t length = digit(w) == 15 ? 16 : static_cast<std::size_t>(digit(w));
    if (2 * in.size() - at < length) return false;
    std::uint64_t rest = 0;
    for (std::size_t d = 0; d < length; ++d) rest |= digit(at++) << (4 * d);
    now[w] = guessed_word(now, before, w) + unfolded(rest);
  }
  in.remove_prefix((at + 1) / 2);
  before = now;
  tick = tick_of(now);
  return true;
}

}  // namespace trephine
