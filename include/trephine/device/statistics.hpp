// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// Mean, percentiles and maximum of durations [s]. All zero without samples.
struct TimeSummary {
  std::uint64_t count = 0;
  double mean = 0;
  double p50 = 0;
  double p99 = 0;
  double p99_9 = 0;
  double p99_99 = 0;
  double max = 0;
};

/// A histogram of durations with fixed memory (about 19 kB) for any number of samples. Bins are exact to 255 ns, then
/// 128 per octave up to 2^40 ns (18 minutes); the last bin holds longer durations. A quantile is the upper end of its
/// bin, at most the exact maximum: never understated, overstated by less than 1/128 (0.8 %). Count, mean and maximum
/// are exact. `add` takes a few nanoseconds and allocates nothing. One thread.
class TimeHistogram {
 public:
  /// Adds a duration [s]; negative durations and NaN count as 0.
  void add(double seconds) noexcept {
    const double ns = std::min(seconds > 0 ? seconds * 1e9 : 0.0, kMaxNanoseconds);
    const auto whole = static_cast<std::uint64_t>(ns + 0.5);
    ++bins_[bin_of(whole)];
    ++count_;
    sum_ += ns;
    max_ = std::max(max_, whole);
  }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double mean() const noexcept { return count_ > 0 ? 1e-9 * sum_ / static_cast<double>(count_) : 0.0; }
  [[nodiscard]] double max() const noexcept { return 1e-9 * static_cast<double>(max_); }

  /// Returns the q-quantile [s], q in [0, 1], to the accuracy above: the smallest duration that a share q of the
  /// samples does not exceed.
  [[nodiscard]] double quantile(double q) const noexcept {
    if (count_ == 0) return 0.0;
    const double rank = std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_));
    const std::uint64_t needed = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rank));
    std::uint64_t cumulated = 0;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      cumulated += bins_[i];
      if (cumulated >= needed) return 1e-9 * static_cast<double>(std::min(last_of(i), max_));
    }
    return max();
  }

  [[nodiscard]] TimeSummary summary() const noexcept {
    return {.count = count_,
            .mean = mean(),
            .p50 = quantile(0.5),
            .p99 = quantile(0.99),
            .p99_9 = quantile(0.999),
            .p99_99 = quantile(0.9999),
            .max = max()};
  }

  void clear() noexcept { *this = TimeHistogram{}; }

 private:
  static constexpr int kBits = 7;                                 // sets the relative error of quantiles: 2^-7
  static constexpr std::size_t kSteps = std::size_t{1} << kBits;  // bins per octave
  static constexpr int kOctaves = 40 - kBits;                     // sets the longest duration: 2^40 ns
  static constexpr double kMaxNanoseconds = static_cast<double>((std::uint64_t{1} << 40) - 1);

  static constexpr std::size_t bin_of(std::uint64_t ns) noexcept {
    if (ns < kSteps) return static_cast<std::size_t>(ns);
    const int shift = static_cast<int>(std::bit_width(ns)) - 1 - kBits;
    return (static_cast<std::size_t>(shift) + 1) * kSteps + static_cast<std::size_t>((ns >> shift) - kSteps);
  }

  /// Returns the longest duration of bin i [ns].
  static constexpr std::uint64_t last_of(std::size_t i) noexcept {
    if (i < kSteps) return i;
    const auto shift = static_cast<int>(i / kSteps) - 1;
    return ((std::uint64_t{kSteps} + i % kSteps + 1) << shift) - 1;
  }

  std::array<std::uint32_t, (kOctaves + 1) * kSteps> bins_{};
  std::uint64_t count_ = 0;
  std::uint64_t max_ = 0;
  double sum_ = 0;
};

}  // namespace trephine
