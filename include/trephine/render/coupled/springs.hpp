// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/coupled_constants.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

/// Springs of the virtual coupling: bounded, and compensated for the contact's own yield.
namespace trephine::inline TREPHINE_ALIGNED {

/// Response of a spring at an extension.
struct SpringResponse {
  double magnitude = 0;  ///< of the force [N], or of the torque [N·m]
  double tangent = 0;    ///< d magnitude / d extension
  double energy = 0;     ///< ∫ magnitude d extension [J]
};

/// Spring of constant stiffness up to a limit, and of constant force beyond. Its force is bounded, and the gradient of
/// an energy.
struct BoundedSpring {
  double stiffness = 1;  ///< [N/m] or [N·m/rad]
  double limit = 0;      ///< largest magnitude [N] or [N·m]

  [[nodiscard]] SpringResponse evaluate(double extension) const noexcept {
    const double saturation = limit / stiffness;
    if (extension <= saturation) return {stiffness * extension, stiffness, 0.5 * stiffness * extension * extension};
    return {limit, 0, limit * (extension - 0.5 * saturation)};
  }
};

/// Force of an elastic foundation on a ball that is pressed into a plane. The pressure is k times the mean of
/// max(ψ − s, 0) over 0 <= s <= `ramp`, ψ the local depth (`FoundationLaw`), so at depth δ
///
///     P(δ) = π k (R − δ) (δ³ − v³) / (3 ramp),    v = max(δ − ramp, 0).
struct BallOnPlane {
  double gain;    ///< π k [N/m³]
  double radius;  ///< R [m]
  double ramp;    ///< [m], > 0

  /// P [N] at a depth [m].
  [[nodiscard]] double force(double depth) const noexcept {
    const double d = depth, v = std::max(d - ramp, 0.0);
    return gain / (3 * ramp) * ((radius - d) * (d * d * d - v * v * v));
  }
  /// dP / dδ [N/m].
  [[nodiscard]] double slope(double depth) const noexcept {
    const double d = depth, v = std::max(d - ramp, 0.0);
    return gain / (3 * ramp) * (3 * (radius - d) * (d * d - v * v) - (d * d * d - v * v * v));
  }
  /// ∫ P dδ from 0 [J].
  [[nodiscard]] double energy(double depth) const noexcept {
    const double d = depth, v = std::max(d - ramp, 0.0);
    const auto quartic = [](double r, double x) { return x * x * x * x * (r / 4 - x / 5); };
    return gain / (3 * ramp) * (quartic(radius, d) - quartic(radius - ramp, v));
  }
};

/// Spring that is stiffer by as much as the contact yields, so that spring and contact in series have the stiffness k.
/// Under the contact's force P(δ) the spring's extension is
///
///     x(δ) = ε P / k                                    for δ <= δ_c,
///     x(δ) = ε P_c / k + (P − P_c) / k − (δ − δ_c)      beyond,
///
/// with δ_c the depth from which the contact is stiff enough: P'(δ_c) = k / (1 − ε). The hand feels k beyond P_c, some
/// millinewtons, and less below.
class CompensatedSpring {
 public:
  CompensatedSpring() = default;
  /// `stiffness` is k [N/m]; `yield` is the contact's depth at the largest force [m], where it must be stiffer than k.
  CompensatedSpring(double stiffness, const BallOnPlane& contact, double yield) noexcept
      : stiffness_(stiffness), contact_(contact), yield_(yield), max_force_(contact.force(yield)) {
    double low = 0, high = yield;
    for (int i = 0; i < Constants::kBisections; ++i) {
      const double middle = (low + high) / 2;
      (contact.slope(middle) * (1 - kEpsilon) < stiffness ? low : high) = middle;
    }
    onset_depth_ = high;
    onset_force_ = contact.force(onset_depth_);
    onset_energy_ = contact.energy(onset_depth_) - (1 - kEpsilon) * onset_force_ * onset_force_ / (2 * stiffness_);
    max_extension_ = (max_force_ - (1 - kEpsilon) * onset_force_) / stiffness_ - (yield_ - onset_depth_);
    depths_[kIntervals] = yield_;
    for (std::size_t i = kIntervals; i-- > 0;) {
      const double root = static_cast<double>(i) / kIntervals;
      depths_[i] = depth_at(std::max(root * root * max_extension_, onset_extension()), depths_[i + 1]);
    }
  }

  /// k [N/m].
  [[nodiscard]] double stiffness() const noexcept { return stiffness_; }
  /// Extension from which the force is the largest [m].
  [[nodiscard]] double max_extension() const noexcept { return max_extension_; }
  /// Largest force [N].
  [[nodiscard]] double max_force() const noexcept { return max_force_; }
  /// Distance outside the surface [m] at which contact has to begin, so that the felt force is k times the depth below
  /// the surface.
  [[nodiscard]] double offset() const noexcept { return onset_depth_ - (1 - kEpsilon) * onset_force_ / stiffness_; }

  /// Response at an extension [m].
  [[nodiscard]] SpringResponse evaluate(double extension) const noexcept {
    const double x = extension;
    if (!(x > onset_extension())) return BoundedSpring{stiffness_ / kEpsilon, max_force_}.evaluate(x);
    double d = yield_;
    if (x < max_extension_) {
      const double at = kIntervals * std::sqrt(x / max_extension_);
      // Exact arithmetic and IEEE's keep `at` below kIntervals; that of -ffast-math may not.
      const std::size_t i = std::min(static_cast<std::size_t>(at), kIntervals - 1);
      d = depth_at(x, depths_[i] + (at - static_cast<double>(i)) * (depths_[i + 1] - depths_[i]));
    }
    const double P = x < max_extension_ ? contact_.force(d) : max_force_;
    const double energy = P * P / (2 * stiffness_) - contact_.energy(d) + onset_energy_;
    const double slope = contact_.slope(d);
    return {P, x < max_extension_ ? slope * stiffness_ / (slope - stiffness_) : 0,
            energy + max_force_ * std::max(0.0, x - max_extension_)};
  }

 private:
  using Constants = CoupledConstants;
  static constexpr double kEpsilon = Constants::kMinCompliance;
  static constexpr std::size_t kIntervals = Constants::kSpringIntervals;

  /// Extension at δ_c [m].
  [[nodiscard]] double onset_extension() const noexcept { return kEpsilon * onset_force_ / stiffness_; }

  /// Depth δ [m] at an extension [m] from δ_c on, by Newton's method from a depth. x(δ) is convex there: a step from
  /// below the root goes above it, and steps from above stay above.
  [[nodiscard]] double depth_at(double extension, double depth) const noexcept {
    const double pulled = stiffness_ * (extension - onset_depth_) + (1 - kEpsilon) * onset_force_;
    for (int i = 0; i < Constants::kMaxSpringSteps; ++i) {
      const double step = (contact_.force(depth) - stiffness_ * depth - pulled) / (contact_.slope(depth) - stiffness_);
      depth = std::max(depth - step, onset_depth_);
      if (!(std::abs(step) > Constants::kSpringRoot * depth)) break;
    }
    return depth;
  }

  double stiffness_ = 1;
  BallOnPlane contact_{1, 1, 1};
  double yield_ = 0;          // δ at the largest force [m]
  double max_force_ = 0;      // [N]
  double onset_depth_ = 0;    // δ_c [m]
  double onset_force_ = 0;    // P_c [N]
  double onset_energy_ = 0;   // that makes the energy continuous there [J]
  double max_extension_ = 0;  // at the largest force [m]
  // Depths at evenly spaced roots of the extension, between which Newton's method starts [m].
  std::array<double, kIntervals + 1> depths_{};
};

}  // namespace trephine
