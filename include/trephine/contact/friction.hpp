// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

#include <concepts>

/// Friction laws of a proxy: frictionless and Coulomb.
namespace trephine::inline TREPHINE_ALIGNED {

/// Friction law of a proxy. `slip(tangential, depth, sticking)` returns the distance [m] by which the proxy slides
/// toward its probe. `tangential` and `depth` are the tangential and normal distances between both [m]. The spring
/// between them makes the distances proportional to forces, so Coulomb's cone is a cone of distances. Eriksson 2006;
/// thesis 2.1.3.
template <class F>
concept Friction = requires(const F& f, double t, double d, bool b) {
  { f.slip(t, d, b) } noexcept -> std::same_as<double>;
};

/// No friction: the proxy slides by the whole tangential distance.
struct Frictionless {
  [[nodiscard]] double slip(double tangential, double, bool) const noexcept { return tangential; }
};

/// Coulomb friction with static and kinetic coefficients. A sticking proxy starts to slide when the tangential force
/// exceeds μ_s times the normal force. A sliding proxy stops where the tangential force equals μ_k times the normal
/// force.
class Coulomb {
 public:
  /// Throws std::invalid_argument unless 0 <= kinetic_coefficient <= static_coefficient, both finite.
  explicit Coulomb(double static_coefficient = 0.2, double kinetic_coefficient = 0.15)
      : static_(static_coefficient), kinetic_(kinetic_coefficient) {
    if (!(kinetic_ >= 0)) refuse("Coulomb", "the kinetic coefficient must be >= 0", kinetic_);
    if (!(static_ >= kinetic_) || !is_finite(static_))
      refuse("Coulomb", "the static coefficient must be finite and at least the kinetic one", static_);
  }

  [[nodiscard]] double static_coefficient() const noexcept { return static_; }
  [[nodiscard]] double kinetic_coefficient() const noexcept { return kinetic_; }

  [[nodiscard]] double slip(double tangential, double depth, bool sticking) const noexcept {
    // Copies and a weight instead of branches, so that loops over points are vectorised.
    const double while_sticking = static_, while_sliding = kinetic_;
    const double limit = (sticking ? while_sticking : while_sliding) * depth;
    return (tangential <= limit ? 0.0 : 1.0) * (tangential - while_sliding * depth);
  }

 private:
  double static_;
  double kinetic_;
};

}  // namespace trephine
