// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <numbers>
#include <random>

namespace pick {

/// The same numbers from the same seed with every standard library: its distributions are each library's own.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// In [0, 1).
  [[nodiscard]] double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  [[nodiscard]] double between(double a, double b) { return a + (b - a) * unit(); }
  /// Of n things, 0 to n - 1.
  [[nodiscard]] std::size_t index(std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(unit() * static_cast<double>(n)));
  }
  /// Evenly over the unit sphere.
  [[nodiscard]] trephine::Vec3d direction() { return direction_near(trephine::Vec3d::UnitZ(), -1); }
  /// Evenly over the part of the unit sphere whose angle to the unit vector `axis` has a cosine of `least` or more.
  [[nodiscard]] trephine::Vec3d direction_near(const trephine::Vec3d& axis, double least) {
    const double c = between(least, 1);
    const double s = std::sqrt(std::max(0.0, 1 - c * c));
    return c * axis + s * square_to(axis);
  }
  /// A unit vector square to the unit vector `axis`.
  [[nodiscard]] trephine::Vec3d square_to(const trephine::Vec3d& axis) {
    const double a = between(0, 2 * std::numbers::pi);
    const trephine::Vec3d u = axis.unitOrthogonal();
    return std::cos(a) * u + std::sin(a) * axis.cross(u);
  }
  template <class T>
  void shuffle(std::vector<T>& v) {
    for (std::size_t i = v.size(); i > 1; --i) std::swap(v[i - 1], v[index(i)]);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace pick
