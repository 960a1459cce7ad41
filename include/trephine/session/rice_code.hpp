// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Whole numbers in few bits: Rice's code, as files of lossless audio have it, with a parameter that follows the
/// numbers. A number v is written as v >> k ones, a zero, and the lowest k bits of v. Eight ones are followed by v's
/// length in 6 bits, less 1, and by v without its highest bit. Bits fill bytes from the lowest on.
namespace trephine::inline TREPHINE_ALIGNED::session_detail {

/// Appends bits to a text, each writer from a byte of its own.
class BitWriter {
 public:
  explicit BitWriter(std::string& out) : out_(out) {}
  /// Appends the lowest bits of the value, at most 64.
  void put(std::uint64_t value, int bits) {
    while (bits > 0) {
      if (room_ == 0) {
        out_.push_back('\0');
        room_ = 8;
      }
      const int count = std::min(bits, room_);
      const auto part = static_cast<unsigned>(value & ((1U << count) - 1)) << (8 - room_);
      out_.back() = static_cast<char>(static_cast<unsigned char>(out_.back()) | part);
      value >>= count;
      bits -= count;
      room_ -= count;
    }
  }

 private:
  std::string& out_;
  int room_ = 0;
};

/// Takes bits from the front of a text. Beyond its end there are zeros, and `is_short` says so.
class BitReader {
 public:
  explicit BitReader(std::string_view in) : in_(in) {}
  [[nodiscard]] std::uint64_t take(int bits) noexcept {
    std::uint64_t value = 0;
    for (int have = 0; have < bits;) {
      const std::size_t at = used_ / 8;
      const int skip = static_cast<int>(used_ % 8), count = std::min(bits - have, 8 - skip);
      const unsigned byte = at < in_.size() ? static_cast<unsigned char>(in_[at]) : 0U;
      value |= static_cast<std::uint64_t>((byte >> skip) & ((1U << count) - 1)) << have;
      have += count;
      used_ += static_cast<std::size_t>(count);
    }
    return value;
  }
  /// Bytes of which a bit was taken.
  [[nodiscard]] std::size_t bytes() const noexcept { return (used_ + 7) / 8; }
  [[nodiscard]] bool is_short() const noexcept { return bytes() > in_.size(); }

 private:
  std::string_view in_;
  std::size_t used_ = 0;
};

/// Writes or reads one row of numbers, and learns their length from it: both sides start alike.
class RiceCode {
 public:
  void put(BitWriter& out, std::uint64_t v) {
    const int k = parameter(), length = static_cast<int>(std::bit_width(v));
    const std::uint64_t ones = v >> k;
    if (ones < kMostOnes) {
      out.put((std::uint64_t{1} << ones) - 1, static_cast<int>(ones) + 1);
      out.put(v, k);
    } else {
      out.put((1U << kMostOnes) - 1, kMostOnes);
      out.put(static_cast<std::uint64_t>(length - 1), 6);
      out.put(v, length - 1);
    }
    learn(length);
  }
  [[nodiscard]] std::uint64_t take(BitReader& in) noexcept {
    const int k = parameter();
    int ones = 0;
    while (ones < kMostOnes && in.take(1) != 0) ++ones;
    std::uint64_t v = 0;
    if (ones < kMostOnes) {
      v = static_cast<std::uint64_t>(ones) << k;
      v |= in.take(k);
    } else {
      const int lower = static_cast<int>(in.take(6));
      v = in.take(lower) | std::uint64_t{1} << lower;
    }
    learn(static_cast<int>(std::bit_width(v)));
    return v;
  }

 private:
  static constexpr int kMostOnes = 8;
  static constexpr int kUnit = 8;  // parts of a bit in which the mean is kept

  [[nodiscard]] int parameter() const noexcept { return std::min(mean_ / kUnit, 63); }
  void learn(int length) noexcept { mean_ += (kUnit * length - mean_) / 2; }

  int mean_ = 0;  // length of the latest numbers
};

/// Differences of words as numbers that are small where the words are near: the sign in the lowest bit.
[[nodiscard]] constexpr std::uint64_t folded(std::uint64_t difference) noexcept {
  return (difference << 1) ^ (0 - (difference >> 63));
}
[[nodiscard]] constexpr std::uint64_t unfolded(std::uint64_t rest) noexcept { return (rest >> 1) ^ (0 - (rest & 1)); }

}  // namespace trephine
