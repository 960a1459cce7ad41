// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace trephine::test {

/// Spectra of long signals by their definition, under a window of Blackman and Harris, whose leakage is below −92 dB
/// beyond four bins of a line. A cosine of amplitude A has the magnitude A.
class Spectrum {
 public:
  explicit Spectrum(std::span<const double> signal) : windowed_(signal.begin(), signal.end()) {
    const double step = 2 * std::numbers::pi / static_cast<double>(windowed_.size());
    for (std::size_t i = 0; i < windowed_.size(); ++i) {
      const double a = step * static_cast<double>(i);
      const double w = 0.35875 - 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) - 0.01168 * std::cos(3 * a);
      windowed_[i] *= w;
      sum_ += w;
    }
  }
  /// Magnitude at a frequency by the sampling rate, 0 to 1/2.
  [[nodiscard]] double at(double frequency) const {
    const std::complex<double> turn = std::polar(1.0, -2 * std::numbers::pi * frequency);
    std::complex<double> sum = 0;
    for (std::size_t i = windowed_.size(); i-- > 0;) sum = sum * turn + windowed_[i];  // Horner
    return (frequency > 0 ? 2 : 1) * std::abs(sum) / sum_;
  }
  [[nodiscard]] int bins() const { return static_cast<int>(windowed_.size() / 2); }
  [[nodiscard]] double bin(int i) const { return at(i / static_cast<double>(windowed_.size())); }
  static constexpr int kLobe = 4;  ///< half width of a line [bins]

 private:
  std::vector<double> windowed_;
  double sum_ = 0;
};

[[nodiscard]] inline double decibel(double ratio) { return 20 * std::log10(ratio); }

}  // namespace trephine::test
