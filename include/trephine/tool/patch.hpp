// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cmath>

/// Vertices that stand for the patch of tool surface around them: what of that patch is in bone, were the bone's
/// surface flat there. With it a vertex enters contact gradually, as its patch does, instead of all at once.
namespace trephine {

/// Mean over a disc of radius 1 of max(0, q + u), u a Cartesian coordinate on it: 0 for q <= −1, q for q >= 1, between
/// (with θ = arccos(−q)) [ (1−q²)^½ (2 + q²)/3 + q θ ] / π.
template <RealScalar Scalar>
[[nodiscard]] Scalar mean_over_disc(Scalar q) noexcept {
  if (!(q > Scalar(-1))) return Scalar(0);
  if (q >= Scalar(1)) return q;
  const Scalar root = std::sqrt(Scalar(1) - q * q);
  return (root * (Scalar(2) + q * q) / Scalar(3) + q * std::acos(-q)) * Scalar(0.31830988618379067);
}

/// Mean of max(0, s + u + v) over |u| <= a, |v| <= b: a rectangle across which the depth rises by 2a and 2b.
template <RealScalar Scalar>
[[nodiscard]] Scalar mean_over_rectangle(Scalar s, Scalar a, Scalar b) noexcept {
  a = std::abs(a);
  b = std::abs(b);
  if (a < b) std::swap(a, b);
  if (s >= a + b) return s;
  if (s <= -(a + b)) return Scalar(0);
  // Second integrals of max(0, x): x³/6 at the corners. Where b is small these differences cancel: its mean square goes
  // into the one-dimensional mean instead.
  const auto ramp = [](Scalar x, int power) { return x > Scalar(0) ? (power == 2 ? x * x : x * x * x) : Scalar(0); };
  if (b < Scalar(0.05) * a) return (ramp(s + a, 2) - ramp(s - a, 2)) / (Scalar(4) * a);
  return (ramp(s + a + b, 3) - ramp(s + a - b, 3) - ramp(s - a + b, 3) + ramp(s - a - b, 3)) / (Scalar(24) * a * b);
}

/// The extent of a vertex' patch. Of a ball: a disc of the area it stands for. Of a slice: a rectangle, the arc between
/// vertices by the length of shaft between slices.
template <RealScalar Scalar>
struct Patch {
  Scalar radius;        ///< of ball or shaft [m]
  Scalar disc = 0;      ///< the disc's radius [m]; 0 for a rectangle
  Scalar half_arc = 0;  ///< [m]
  Scalar half_length = 0;

  template <RealScalar Other>
  [[nodiscard]] Patch<Other> cast() const noexcept {
    return {Other(radius), Other(disc), Other(half_arc), Other(half_length)};
  }

  /// Farthest that a point of the patch is from the vertex [m].
  [[nodiscard]] Scalar reach() const noexcept { return disc > Scalar(0) ? disc : half_arc + half_length; }

  /// The patch's mean way out along the vertex' direction, for a flat surface with outward unit normal n that lies
  /// `depth` [m] above the vertex along n (negative: below it). `inward`: unit direction toward the centre; `axis`: the
  /// shaft's. The tool's curvature counts to second order: the patch' points lie deeper in the tool's body than its
  /// tangent plane.
  [[nodiscard]] Scalar mean_way(Scalar depth, const Vec3<Scalar>& n, const Vec3<Scalar>& inward,
                                const Vec3<Scalar>& axis) const noexcept {
    constexpr Scalar kLeastCosine = Scalar(0.1);
    const Scalar cosine = n.dot(inward);
    if (!(cosine > kLeastCosine)) return Scalar(0);
    Scalar mean;
    if (disc > Scalar(0)) {
      const Scalar s = depth - cosine * disc * disc / (Scalar(4) * radius);
      const Scalar slope = disc * std::sqrt(std::max(Scalar(0), Scalar(1) - cosine * cosine));
      mean = slope > Scalar(1e-4) * std::abs(s) ? slope * mean_over_disc(s / slope) : std::max(s, Scalar(0));
    } else {
      const Scalar s = depth - cosine * half_arc * half_arc / (Scalar(6) * radius);
      mean = mean_over_rectangle(s, half_arc * n.dot(axis.cross(inward)), half_length * n.dot(axis));
    }
    return mean / cosine;
  }
};

}  // namespace trephine
