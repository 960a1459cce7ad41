// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/structure/smooth_distance.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Which of many smooth distances of one spacing have knots about a point: one lookup, however many there are.
///
/// Memory: 4 bytes for each block of 8³ knots in the box of all. Immutable; lookups from any thread.
class NearSplines {
 public:
  NearSplines() = default;
  /// For at most 256 distances; allocates.
  explicit NearSplines(std::span<const SmoothDistance> all) {
    constexpr int kMax = std::numeric_limits<int>::max(), kMin = std::numeric_limits<int>::min();
    std::array<int, 3> last{kMin, kMin, kMin};
    first_ = {kMax, kMax, kMax};
    for (const SmoothDistance& one : all)
      one.for_each_block([&](const std::array<int, 3>& at) {
        for (std::size_t a = 0; a < 3; ++a) {
          first_[a] = std::min(first_[a], at[a]);
          last[a] = std::max(last[a], at[a]);
        }
      });
    if (first_[0] > last[0]) return;
    for (std::size_t a = 0; a < 3; ++a) count_[a] = last[a] - first_[a] + 1;
    // The numbers of each block's distances follow each other: count them, then fill them in.
    begin_.assign(entry(last) + 2, 0);
    for (const SmoothDistance& one : all)
      one.for_each_block([&](const std::array<int, 3>& at) { ++begin_[entry(at) + 1]; });
    for (std::size_t n = 1; n < begin_.size(); ++n) begin_[n] += begin_[n - 1];
    numbers_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < all.size(); ++i)
      all[i].for_each_block(
          [&](const std::array<int, 3>& at) { numbers_[next[entry(at)]++] = static_cast<std::uint8_t>(i); });
  }

  /// Returns the numbers of the distances with knots about a place, ascending. All others have none there.
  [[nodiscard]] std::span<const std::uint8_t> at(const SmoothDistance::Place& place) const noexcept {
    if (!place.is_valid()) return {};
    const std::array<int, 3> block = place.block();
    for (std::size_t a = 0; a < 3; ++a)
      if (block[a] < first_[a] || block[a] - first_[a] >= count_[a]) return {};
    const std::size_t n = entry(block);
    return {numbers_.data() + begin_[n], begin_[n + 1] - begin_[n]};
  }
  [[nodiscard]] std::size_t bytes() const noexcept { return begin_.size() * sizeof(std::uint32_t) + numbers_.size(); }

 private:
  [[nodiscard]] std::size_t entry(const std::array<int, 3>& at) const noexcept {
    const auto along = [&](std::size_t a) { return static_cast<std::size_t>(at[a] - first_[a]); };
    const auto count = [&](std::size_t a) { return static_cast<std::size_t>(count_[a]); };
    return (along(2) * count(1) + along(1)) * count(0) + along(0);
  }

  std::array<int, 3> first_{}, count_{};  // of blocks
  std::vector<std::uint32_t> begin_;      // of each block's numbers, and the end
  std::vector<std::uint8_t> numbers_;
};

}  // namespace trephine
