// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

/// The spring between the device's pose and the virtual tool's (Colgate 1995; Wan and McNeely 2003).
namespace trephine {

/// Pull of a spring at an extension, with what a Newton step and an energy need.
struct SpringPull {
  double pull = 0;     ///< [N] or [N·m]
  double tangent = 0;  ///< d pull / d extension
  double energy = 0;   ///< ∫ pull [J]
};

/// A spring of constant stiffness k up to its greatest pull, constant beyond: what it does is the gradient of an
/// energy, and bounded at once.
struct BoundedSpring {
  double stiffness;
  double most;

  [[nodiscard]] SpringPull at(double extension) const noexcept {
    const double bend = most / stiffness;
    if (extension <= bend) return {stiffness * extension, stiffness, 0.5 * stiffness * extension * extension};
    return {most, 0, most * (extension - 0.5 * bend)};
  }
};

/// The same in series with a contact that yields: the two together have the stiffness k. A ball of radius R pressed on
/// a plane by δ is held with P(δ) = c (R − δ) δ², exactly, c = π times the foundation's stiffness. So the spring's
/// extension under P(δ) is
///
///     x(δ) = P(δ) / k − δ · δ² / (δ² + δ₀²),    δ₀ = k / (c R):
///
/// P / k less δ, but for the smallest forces (.0005 N at 800 N/m), where a contact is softer than k. It grows
/// everywhere for δ up to R / 4.
struct CompensatedSpring {
  double stiffness;  ///< k
  double most;       ///< greatest pull P_m
  double yield;      ///< δ_m, the contact's depth under it [m], at most R / 4
  double radius;     ///< R [m]

  [[nodiscard]] SpringPull at(double extension) const noexcept {
    const double c = most / ((radius - yield) * yield * yield), per_k = 1 / stiffness;
    const double d0 = stiffness / (c * radius), a = d0 * d0;
    const auto pull = [&](double d) { return c * (radius - d) * d * d; };
    const double most_extension = most * per_k - yield * yield * yield / (yield * yield + a);
    const double x = std::min(extension, most_extension);
    // Newton's steps from above, where x(δ) bends upward.
    double d = extension < most_extension ? std::min(yield, std::sqrt(stiffness * (x + yield) / (c * (radius - yield))))
                                          : yield;
    double slope = 0;
    for (int i = 0; i < kMostSteps && x > 0; ++i) {
      const double s = d * d, sum = s + a;
      slope = c * d * (2 * radius - 3 * d) * per_k - s * (s + 3 * a) / (sum * sum);
      const double step = (pull(d) * per_k - d * s / sum - x) / slope;
      if (!(std::abs(step) > 1e-15 * d)) break;
      d = std::max(d - step, d / 4);
    }
    SpringPull out;
    if (!(x > 0)) return {0, stiffness, 0};
    out.pull = extension < most_extension ? pull(d) : most;
    out.tangent = extension < most_extension ? c * d * (2 * radius - 3 * d) / slope : 0;
    // ∫ P dx = P x − P² / 2k + ∫ δ w dP, w = δ² / (δ² + δ₀²).
    const double s = d * d, d3 = s * d;
    const double turned = c * (2 * radius * (d3 / 3 - a * d + a * d0 * std::atan(d / d0)) -
                               3 * (s * s / 4 - a * s / 2 + a * a / 2 * std::log1p(s / a)));
    out.energy =
        out.pull * x - out.pull * out.pull * per_k / 2 + turned + most * std::max(0.0, extension - most_extension);
    return out;
  }

 private:
  static constexpr int kMostSteps = 20;
};

}  // namespace trephine
