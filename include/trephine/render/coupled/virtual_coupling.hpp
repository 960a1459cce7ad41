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

/// The same in series with a contact that yields: the two together have the stiffness k. A ball pressed on a plane with
/// P yields by δ(P) = δ_m √(P / P_m), a foundation's law, so the spring's extension under P is
///
///     x(P) = P / k − δ_m P / √(P_m (P + P₀)),    P₀ = 4 (k δ_m)² / P_m:
///
/// P / k less δ(P), but for the smallest forces (P₀ is .008 N at 800 N/m), where a foundation is softer than k and the
/// spring at most twice as stiff: x' lies between 1/(2k) and 1/k.
struct CompensatedSpring {
  double stiffness;  ///< k
  double most;       ///< P_m: greatest pull, and the force that δ_m belongs to
  double yield;      ///< δ_m [m]

  [[nodiscard]] SpringPull at(double extension) const noexcept {
    const double c = yield / std::sqrt(most), per_k = 1 / stiffness;
    const double p0 = 4 * stiffness * stiffness * c * c;
    const double most_extension = most * per_k - c * most / std::sqrt(most + p0);
    const double x = std::min(extension, most_extension);
    // With s = √(P + P₀) x is (s² − P₀)(1/k − c/s): convex, so Newton's steps from above end at it.
    double s = std::sqrt(p0 + 2 * stiffness * x);
    double slope = 0;
    for (int i = 0; i < kMostSteps; ++i) {
      const double over = (s * s - p0) * (per_k - c / s) - x;
      slope = 2 * s * per_k - c - c * p0 / (s * s);
      const double step = over / slope;
      s -= step;
      if (std::abs(step) <= 1e-15 * s) break;
    }
    SpringPull out;
    out.pull = extension < most_extension ? std::max(s * s - p0, 0.0) : most;
    slope = 2 * s * per_k - c - c * p0 / (s * s);
    out.tangent = extension < most_extension ? 2 * s / slope : 0;  // dP/dx = (dP/ds) / (dx/ds)
    const double stored = out.pull * x - out.pull * out.pull * per_k / 2 +
                          c * (2.0 / 3.0 * (s * s * s) - 2 * p0 * s + 4.0 / 3.0 * p0 * std::sqrt(p0));
    out.energy = stored + most * std::max(0.0, extension - most_extension);
    return out;
  }

 private:
  static constexpr int kMostSteps = 12;
};

}  // namespace trephine
