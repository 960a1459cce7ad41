// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/tool/cutting_edges.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>

namespace trephine::inline TREPHINE_ALIGNED {

/// How a tooth's force varies over a turn of the spindle.
struct ToothPattern {
  /// Angle over which a tooth cuts [rad], in (0, π]: arccos(1 − a/R) for a burr of radius R that cuts a deep, and π in
  /// a slot. The default is for a = 0.3 R.
  double arc = std::numbers::pi / 4;
  /// Relative rise and fall of the force over a turn, from teeth that do not run true; 0 to 1.
  double runout = 0;
  /// Standard deviation of the teeth's shares of the force, by their mean; 0 to 1. Hands feed a tooth by a micrometre
  /// or less, so that unequal teeth cut unequal chips.
  double spread = 0;

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(arc > 0) || !(arc <= std::numbers::pi)) refuse("ToothPattern", "arc must be in (0, pi] rad", arc);
    if (!(runout >= 0) || !(runout <= 1)) refuse("ToothPattern", "runout must be in [0, 1]", runout);
    if (!(spread >= 0) || !(spread <= 1)) refuse("ToothPattern", "spread must be in [0, 1]", spread);
  }
};

/// The ripple of a cutting force by the passing of teeth: a sum of lines, band-limited for the rate at which it is
/// sampled. It is relative to the mean force over a turn, so its own mean is 0:
///
///     (1 + r cos θ) (1 + Σ a(m z) cos(m z θ)) − 1 + Σ b_k cos(k θ + φ_k),
///     a(k) = 2 cos(x) / (1 − (2x/π)²),    x = k arc / 2.
///
/// θ is the spindle's angle, z the number of teeth, r the runout. a are the Fourier coefficients of z half sines a
/// turn: a chip's thickness from its tooth's entry to its exit. Lines are at z times the spindle's frequency and its
/// harmonics; runout adds one at the spindle's frequency and one on each side of every tooth line.
///
/// *Unequal teeth* with the spread σ add lines at the other orders k of the spindle, with b_k = a(k) σ / √z: the root
/// mean square over all burrs of such teeth. A diamond's grains stand anywhere and have these lines alone, at every
/// order, with σ = 1 and `CuttingEdges::kGrains` for z. The phases φ are random numbers that are the same for all
/// burrs.
///
/// *Band limit.* A line of order k has the frequency f = k/2π · `advance` by sample, `advance` being the angle from
/// sample to sample. Its weight is 1 up to a tenth of the sampling rate, falls smoothly, and is 0 from four tenths on.
/// So no line aliases, none starts or ends with a click as the spindle changes, and fast teeth give exactly 0.
/// Changes of load and speed spread lines as they do in nature. A late sample silences the lines for that sample. A
/// force held until the next sample loses 0.14 dB at a tenth of the rate; that is not made up for.
///
/// *Sums.* Over samples of constant speed, Σ u · ripple is at most `sum_bound(advance)` times (|u| at the end +
/// variation of u), by summation by parts. At any speed it is at most `peak` times Σ |u|. With u the work of the mean
/// force in a tick, that bounds the ripple's work.
///
/// A value of fixed size; no allocation. Cost: four sines and cosines, and a few operations a line.
class ToothLines {
 public:
  static constexpr int kHarmonics = 32;   ///< tooth lines, the first included; orders of unequal teeth
  static constexpr double kWhole = 0.1;   ///< frequency up to which a line is whole, by the sampling rate
  static constexpr double kSilent = 0.4;  ///< frequency from which it is 0, by the sampling rate

  ToothLines() = default;  ///< no lines
  /// `edges` and `pattern` are valid.
  ToothLines(const CuttingEdges& edges, const ToothPattern& pattern) noexcept : ToothLines(teeth_of(edges), pattern) {}
  /// For `teeth` >= 0; 0 is a diamond's grains. A single tooth has no runout and no spread.
  ToothLines(int teeth, const ToothPattern& pattern) noexcept
      : teeth_(teeth), runout_(teeth == 1 ? 0 : pattern.runout) {
    const auto coefficient = [&](int order) { return 2 * half_sine(order * pattern.arc / 2); };
    if (teeth_ > 0)
      for (int m = 0; m < kHarmonics; ++m) amplitude_[static_cast<std::size_t>(m)] = coefficient((m + 1) * teeth_);
    const double uneven = teeth_ == 0  ? 1 / std::sqrt(static_cast<double>(CuttingEdges::kGrains))
                          : teeth_ > 1 ? pattern.spread / std::sqrt(static_cast<double>(teeth_))
                                       : 0;
    is_uneven_ = uneven > 0;
    if (!is_uneven_) return;
    std::minstd_rand phases;
    for (int k = 1; k <= kHarmonics; ++k) {
      const double phase = 2 * std::numbers::pi * static_cast<double>(phases()) / std::minstd_rand::max();
      const double size = teeth_ > 0 && k % teeth_ == 0 ? 0 : uneven * coefficient(k);
      uneven_[static_cast<std::size_t>(k - 1)] = {size * std::cos(phase), size * std::sin(phase)};
    }
  }

  /// Number of teeth that make lines; 0 for a diamond's grains.
  [[nodiscard]] static int teeth_of(const CuttingEdges& edges) noexcept {
    return edges.kind == CuttingEdges::Kind::kDiamond ? 0 : edges.flutes;
  }
  [[nodiscard]] int teeth() const noexcept { return teeth_; }

  /// The ripple at the angle `theta` [rad], `advance` [rad] after the sample before.
  [[nodiscard]] double sample(double theta, double advance) const noexcept {
    return sample(theta, advance, [](double) { return 1.0; });
  }
  /// The same through a filter: `gain(angle)`, 0 to 1, is that of a line that advances by this angle from sample to
  /// sample.
  template <class Gain>
  [[nodiscard]] double sample(double theta, double advance, Gain&& gain) const noexcept {
    const double phase = teeth_ * theta, cos_z = std::cos(phase), sin_z = std::sin(phase);
    const double cos_1 = std::cos(theta), sin_1 = std::sin(theta);
    double c = 1, s = 0;  // of m · phase
    const auto turn = [&](double by_c, double by_s) {
      const double turned = c * by_c - s * by_s;
      s = s * by_c + c * by_s;
      c = turned;
    };
    const auto weigh = [&](double angle) {
      const double w = weight(angle);
      return w > 0 ? w * gain(angle) : 0;
    };
    double sum = runout_ > 0 ? runout_ * weigh(advance) * cos_1 : 0;
    for_each_tooth_line(advance, weigh, [&](double amplitude, const Weights& w) {
      turn(cos_z, sin_z);
      sum += amplitude * (w.line * c + w.below * (c * cos_1 + s * sin_1) + w.above * (c * cos_1 - s * sin_1));
    });
    c = 1, s = 0;
    for_each_uneven_line(advance, weigh, [&](const Uneven& line, double w, int) {
      turn(cos_1, sin_1);
      sum += w * (line.cosine * c - line.sine * s);
    });
    return sum;
  }

  /// Upper bound of |sample|.
  [[nodiscard]] double peak(double advance) const noexcept {
    double sum = runout_ * weight(advance);
    for_each_tooth_line(advance, weight, [&](double amplitude, const Weights& w) {
      sum += std::abs(amplitude) * (w.line + w.below + w.above);
    });
    for_each_uneven_line(advance, weight, [&](const Uneven& line, double w, int) { sum += w * line.size(); });
    return sum;
  }

  /// Upper bound of |Σ sample| over any number of samples of constant `advance` > 0. It grows as 1/advance.
  [[nodiscard]] double sum_bound(double advance) const noexcept {
    // |Σ cos(k(θ + i a))| ≤ 1/sin(k a/2), Dirichlet's kernel.
    const auto bound = [&](double w, double order) {
      return w > 0 ? w / std::abs(std::sin(order * advance / 2)) : 0.0;
    };
    double sum = bound(runout_ * weight(advance), 1), order = 0;
    for_each_tooth_line(advance, weight, [&](double amplitude, const Weights& w) {
      order += teeth_;
      sum += std::abs(amplitude) * (bound(w.line, order) + bound(w.below, order - 1) + bound(w.above, order + 1));
    });
    for_each_uneven_line(advance, weight,
                         [&](const Uneven& line, double w, int k) { sum += bound(w * line.size(), k); });
    return sum;
  }

  /// Weight of a line that advances by `angle` [rad] from sample to sample.
  [[nodiscard]] static double weight(double angle) noexcept {
    const double part = std::abs(angle) / (2 * std::numbers::pi);
    if (part <= kWhole) return 1;
    if (!(part < kSilent)) return 0;
    const double s = (kSilent - part) / (kSilent - kWhole);
    return s * s * (3 - 2 * s);
  }

 private:
  /// Spectrum of a half sine, relative to its mean.
  [[nodiscard]] static double half_sine(double x) noexcept {
    const double e = 2 * x / std::numbers::pi - 1;
    return e == 0 ? std::numbers::pi / 4 : std::sin(std::numbers::pi / 2 * e) / (e * (2 + e));
  }

  /// Weights of a tooth line and of runout's lines beside it.
  struct Weights {
    double below, line, above;
  };

  /// Line of an order of the spindle.
  struct Uneven {
    double cosine = 0, sine = 0;
    [[nodiscard]] double size() const noexcept { return std::hypot(cosine, sine); }
  };

  /// Calls with the amplitude and weights of each tooth line that is not silent with its neighbours.
  template <class Weigh, class Function>
  void for_each_tooth_line(double advance, Weigh&& weigh, Function&& function) const noexcept {
    if (teeth_ <= 0) return;
    double order = 0;
    for (const double amplitude : amplitude_) {
      order += teeth_;
      Weights w{0, weigh(order * advance), 0};
      if (runout_ > 0) {
        w.below = runout_ / 2 * weigh((order - 1) * advance);
        w.above = runout_ / 2 * weigh((order + 1) * advance);
      }
      if (!(w.line > 0) && !(w.below > 0)) return;
      function(amplitude, w);
    }
  }

  /// Calls with each line of unequal teeth that is not silent, its weight and its order.
  template <class Weigh, class Function>
  void for_each_uneven_line(double advance, Weigh&& weigh, Function&& function) const noexcept {
    if (!is_uneven_) return;
    int order = 0;
    for (const Uneven& line : uneven_) {
      const double w = weigh(++order * advance);
      if (!(w > 0)) return;
      function(line, w, order);
    }
  }

  int teeth_ = 0;
  double runout_ = 0;
  bool is_uneven_ = false;
  std::array<double, kHarmonics> amplitude_{};
  std::array<Uneven, kHarmonics> uneven_{};
};

}  // namespace trephine
