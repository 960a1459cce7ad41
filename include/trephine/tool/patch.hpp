// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cmath>

/// Penetration of the patch of tool surface around a vertex, integrated in closed form over locally planar bone. With
/// it a vertex enters contact gradually, as its patch does, instead of all at once.
namespace trephine::inline TREPHINE_ALIGNED {

/// Mean of a function h over a patch with coordinates u, v, and its first moments: the means of u h and v h.
template <RealScalar Scalar>
struct PatchMoments {
  Scalar mean = Scalar(0);
  Scalar by_u = Scalar(0);
  Scalar by_v = Scalar(0);
};

/// Moments of h = max(0, q + u) over the unit disc, with u a Cartesian coordinate on it. Both are 0 for q <= −1. For
/// q >= 1 the mean is q and the moment 1/4. Between, with θ = arccos(−q) and r = (1−q²)^½, the mean is
/// [ r (2 + q²)/3 + q θ ] / π and the moment [ q r³/3 + (θ − q r (1 − 2q²))/8 ] 2/π.
template <RealScalar Scalar>
[[nodiscard]] PatchMoments<Scalar> moments_over_disc(Scalar q) noexcept {
  if (!(q > Scalar(-1))) return {};
  if (q >= Scalar(1)) return {q, Scalar(0.25)};
  constexpr auto kPerPi = Scalar(0.31830988618379067);
  const Scalar q2 = q * q;
  const Scalar root = std::sqrt(Scalar(1) - q2);
  const Scalar angle = std::acos(-q);
  return {(root * (Scalar(2) + q2) / Scalar(3) + q * angle) * kPerPi,
          (q * root * (Scalar(1) - q2) / Scalar(3) + (angle - q * root * (Scalar(1) - Scalar(2) * q2)) / Scalar(8)) *
              (Scalar(2) * kPerPi)};
}

/// Moments of h = max(0, s + a u + b v) over |u|, |v| <= 1: a rectangle across which the depth increases by 2a and 2b.
/// F_n is the n-fold integral of the unit step, and x = ±a, y = ±b are the corners. The mean is
/// Σ ± F_3(s + x + y) / 4ab and the moment by u Σ ± [x F_3 − F_4] / 4a²b.
template <RealScalar Scalar>
[[nodiscard]] PatchMoments<Scalar> moments_over_rectangle(Scalar s, Scalar a, Scalar b) noexcept {
  if (std::abs(a) < std::abs(b)) {
    const PatchMoments<Scalar> m = moments_over_rectangle(s, b, a);
    return {m.mean, m.by_v, m.by_u};
  }
  const Scalar long_side = std::abs(a);
  const Scalar short_side = std::abs(b);
  if (s >= long_side + short_side) return {s, a / Scalar(3), b / Scalar(3)};
  if (s <= -(long_side + short_side)) return {};
  const auto ramp = [](Scalar x) { return std::max(x, Scalar(0)); };
  // Below this ratio of the sides the differences of F_n cancel numerically. The depth then counts as constant across
  // the short side, with an error of its square over 24 long sides.
  constexpr auto kThinRatio = Scalar(0.05);
  if (short_side < kThinRatio * long_side) {
    const Scalar hi = ramp(s + long_side);
    const Scalar lo = ramp(s - long_side);
    const Scalar mean = (hi * hi - lo * lo) / (Scalar(4) * long_side);
    const Scalar along = ((hi * hi + lo * lo) / Scalar(2) - (hi * hi * hi - lo * lo * lo) / (Scalar(6) * long_side)) /
                         (Scalar(2) * long_side);
    const Scalar covered = (hi - lo) / (Scalar(2) * long_side);
    return {mean, a > Scalar(0) ? along : -along, b / Scalar(3) * covered};
  }
  PatchMoments<Scalar> m;
  for (const Scalar x : {long_side, -long_side})
    for (const Scalar y : {short_side, -short_side}) {
      const Scalar f = ramp(s + x + y);
      const Scalar f3 = f * f * f / Scalar(6);
      const Scalar f4 = f3 * f / Scalar(4);
      const Scalar sign = (x > Scalar(0)) == (y > Scalar(0)) ? Scalar(1) : Scalar(-1);
      m.mean += sign * f3;
      m.by_u += sign * (x * f3 - f4);
      m.by_v += sign * (y * f3 - f4);
    }
  const Scalar area = Scalar(4) * long_side * short_side;
  return {m.mean / area, m.by_u / (area * a), m.by_v / (area * b)};
}

/// Curvature of the bone's surface under a patch [1/m], positive where bone is convex.
template <RealScalar Scalar>
struct PatchCurvature {
  Scalar arc = Scalar(0);     ///< along a rectangle's arc; under a disc the mean curvature
  Scalar length = Scalar(0);  ///< along the shaft
};

/// Contact spring of a patch: the mean exit vector of its points, and its point of action. A patch point's exit vector
/// points from it, toward the tool's centre, to the bone's surface; it is 0 for points outside bone.
template <RealScalar Scalar>
struct PatchSpring {
  Scalar length = Scalar(0);                      ///< of the mean exit vector [m]
  Vec3<Scalar> direction = Vec3<Scalar>::Zero();  ///< unit vector
  Scalar shaft_offset = Scalar(0);                ///< offset of the point of action from the vertex along the shaft [m]
  Scalar surface_distance = Scalar(0);  ///< distance from there to the bone's surface: mean of h² over mean of h [m]
};

/// Extent of a vertex's patch: on a ball a disc of the vertex's area, on a slice a rectangle. The rectangle spans the
/// arc between vertices and the length of shaft between slices.
template <RealScalar Scalar>
struct Patch {
  Scalar radius;           ///< of ball or shaft [m]
  Scalar disc = 0;         ///< radius of the disc [m]; 0 for a rectangle
  Scalar half_arc = 0;     ///< of the rectangle [m]
  Scalar half_length = 0;  ///< of the rectangle, along the shaft [m]

  // Smallest cosine between normal and inward direction at which a patch is in contact: 87°. Exit distances grow as its
  // reciprocal, and a patch that faces away from bone exits through other bone.
  static constexpr auto kMinCosine = Scalar(0.05);
  // Cosine from which on a spring has its full length: 81°. The length grows from zero between the two, so that a
  // surface that turns away lets go of a patch gradually.
  static constexpr auto kFullCosine = Scalar(0.15);

  template <RealScalar Other>
  [[nodiscard]] Patch<Other> cast() const noexcept {
    return {Other(radius), Other(disc), Other(half_arc), Other(half_length)};
  }

  /// Largest distance of the patch's points from the vertex [m].
  [[nodiscard]] Scalar reach() const noexcept { return disc > Scalar(0) ? disc : half_arc + half_length; }

  /// Spring of the patch against a bone surface with outward unit normal n. The vertex lies `depth` [m] below the
  /// surface along n (negative: above it). `inward` is the vertex's unit direction toward the centre, `axis` the
  /// shaft's.
  ///
  /// At offset u on the patch the depth is h(u) = depth − n·u − (curvature terms). The inward direction is
  /// d(u) = d − u / r, and the exit distance h / (n·d). The slope enters exactly, the curvatures of tool and bone by
  /// their means, and d(u) by its value at the centroid of h. (Inlining is forced: a call costs a sixth of a shaft's
  /// tick.)
  [[nodiscard, gnu::always_inline]] inline PatchSpring<Scalar> spring(
      Scalar depth, const Vec3<Scalar>& n, const Vec3<Scalar>& inward, const Vec3<Scalar>& axis,
      const PatchCurvature<Scalar>& curvature = {}) const noexcept {
    const Scalar cosine = n.dot(inward);
    if (!(cosine > kMinCosine)) return {};
    // Exit vectors converge toward the centre: at the bone the patch is smaller by this factor.
    const Scalar shrunk = Scalar(1) - std::clamp(depth / (cosine * radius), Scalar(0), Scalar(1));
    const Scalar sag = shrunk * shrunk;
    Scalar mean;            // of h
    Scalar square;          // mean of h², from h at the vertex, the slopes and the moments
    Vec3<Scalar> centroid;  // of h, times the mean
    Scalar along = Scalar(0);
    if (disc > Scalar(0)) {
      const Vec3<Scalar> uphill = n - cosine * inward;
      const Scalar slope2 = disc * disc * uphill.squaredNorm();
      // Exit points on slanted bone are farther apart. Their mean square distance grows by tan²/2 once all are in bone.
      const Scalar in_bone = std::min(depth > Scalar(0) ? depth * depth : Scalar(0), slope2);
      const Scalar slant = Scalar(1) + in_bone / (Scalar(2) * disc * disc * cosine * cosine);
      const Scalar s = depth - disc * disc * (cosine / radius + sag * slant * curvature.arc) / Scalar(4);
      if (s * s >= slope2) {  // the disc is entirely in bone or entirely outside: no root is needed
        mean = s;
        square = s * s + Scalar(0.25) * slope2;
        centroid = (Scalar(-0.25) * disc * disc) * uphill;
      } else {
        const Scalar slope = std::sqrt(slope2);
        const PatchMoments<Scalar> m = moments_over_disc(s / slope);
        mean = slope * m.mean;
        square = s * mean + slope2 * m.by_u;
        centroid = (-disc * disc * m.by_u) * uphill;
      }
    } else {
      const Vec3<Scalar> arc = axis.cross(inward);
      const Scalar s = depth - half_arc * half_arc * (cosine / radius + sag * curvature.arc) / Scalar(6) -
                       half_length * half_length * curvature.length / Scalar(6);
      const Scalar by_arc = -half_arc * n.dot(arc), by_length = -half_length * n.dot(axis);
      const PatchMoments<Scalar> m = moments_over_rectangle(s, by_arc, by_length);
      mean = m.mean;
      square = s * mean + by_arc * m.by_u + by_length * m.by_v;
      centroid = (half_arc * m.by_u) * arc;
      along = half_length * m.by_v;
    }
    if (!(mean > Scalar(0))) return {};
    const Scalar per_mean = Scalar(1) / mean;
    const Vec3<Scalar> direction = inward - (per_mean / radius) * centroid;
    const Scalar per_cosine = Scalar(1) / n.dot(direction);
    const Scalar share = std::min((cosine - kMinCosine) / (kFullCosine - kMinCosine), Scalar(1));
    return {share * mean * per_cosine, (Scalar(1) / std::sqrt(direction.squaredNorm())) * direction, along * per_mean,
            square * per_mean * per_cosine};
  }
};

}  // namespace trephine
