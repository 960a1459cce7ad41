// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>
#include <random>

namespace trephine::test {

/// The same numbers on every machine. With every compiler too, where no expression draws twice: which side of a product
/// or which argument comes first is the compiler's to choose. In braces what stands first is drawn first.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  [[nodiscard]] double uniform(double lo = 0, double hi = 1) {
    return lo + (hi - lo) * (static_cast<double>(engine_()) / 4294967296.0);
  }
  [[nodiscard]] int below(int n) { return static_cast<int>(uniform() * n); }
  [[nodiscard]] double normal() {
    const double r = std::sqrt(-2 * std::log(1 - uniform()));
    return r * std::cos(2 * 3.14159265358979323846 * uniform());
  }
  [[nodiscard]] Vec3d unit() {
    Vec3d v;
    do v = Vec3d{normal(), normal(), normal()};
    while (!(v.norm() > 1e-3));
    return v.normalized();
  }
  /// Of any direction, and of a length between those.
  [[nodiscard]] Vec3d arrow(double shortest = 0, double longest = 1) {
    const double length = uniform(shortest, longest);
    return length * unit();
  }
  [[nodiscard]] Mat3d rotation() {
    Quatd q{normal(), normal(), normal(), normal()};
    return q.normalized().toRotationMatrix();
  }

 private:
  std::mt19937 engine_;
};

}  // namespace trephine::test
