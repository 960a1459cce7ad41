// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>

#include <cmath>
#include <concepts>

namespace trephine {

/// How a proxy's tangential move is limited. `slip(tangential, depth, sticking)` answers how far [m] the proxy slides
/// of the `tangential` distance to its probe, `depth` being the normal one: with a spring from probe to proxy both are
/// proportional to forces, so Coulomb's cone is a cone of distances. Eriksson 2006; thesis section 2.1.3.
template <class F>
concept Friction = requires(const F& f, double t, double d, bool b) {
  { f.slip(t, d, b) }
  noexcept->std::same_as<double>;
};

/// Slides all the way.
struct Frictionless {
  [[nodiscard]] double slip(double tangential, double, bool) const noexcept { return tangential; }
};

/// Coulomb's law: a proxy that sticks leaves only when the tangential force exceeds μ_s times the normal one; one that
/// slides stops where it equals μ_k times the normal one.
class Coulomb {
 public:
  /// Throws std::invalid_argument unless 0 <= kinetic_coefficient <= static_coefficient, both finite.
  explicit Coulomb(double static_coefficient = 0.2, double kinetic_coefficient = 0.15)
      : static_(static_coefficient), kinetic_(kinetic_coefficient) {
    if (!(kinetic_ >= 0)) refuse("Coulomb", "the kinetic coefficient must be >= 0", kinetic_);
    if (!(static_ >= kinetic_) || !std::isfinite(static_))
      refuse("Coulomb", "the static coefficient must be finite and at least the kinetic one", static_);
  }

  [[nodiscard]] double slip(double tangential, double depth, bool sticking) const noexcept {
    const double hold = (sticking ? static_ : kinetic_) * depth;
    return tangential <= hold ? 0.0 : tangential - kinetic_ * depth;
  }

 private:
  double static_;
  double kinetic_;
};

}  // namespace trephine
