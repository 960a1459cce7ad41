// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cmath>

/// Vertices that stand for the patch of tool surface around them: what of that patch is in bone, were the bone's
/// surface flat there. With it a vertex enters contact gradually, as its patch does, instead of all at once.
namespace trephine {

/// Of a function h over a patch with coordinates u, v: its mean and its first moments, the means of u h and v h.
template <RealScalar Scalar>
struct PatchMoments {
  Scalar mean = Scalar(0);
  Scalar by_u = Scalar(0);
  Scalar by_v = Scalar(0);
};

/// Of max(0, q + u) over a disc of radius 1, u a Cartesian coordinate on it: nothing for q <= −1, q and 1/4 for q >= 1,
/// between (with θ = arccos(−q), r = (1−q²)^½) [ r (2 + q²)/3 + q θ ] / π and [ q r³/3 + (θ − q r (1 − 2q²))/8 ] 2/π.
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

/// Of max(0, s + a u + b v) over |u|, |v| <= 1: a rectangle across which the depth rises by 2a and 2b. With F_n the
/// n-fold integral of the step, x = ±a and y = ±b at the corners: Σ ± F_3(s + x + y) / 4ab, and for u
/// Σ ± [x F_3 − F_4] / 4a²b.
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
  // Where the short side is short these differences cancel: its mean square goes into the means along the long one.
  if (short_side < Scalar(0.05) * long_side) {
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

/// How bone bends at a patch [1/m], positive where it is convex: the mean curvature under a disc; under a rectangle
/// along its arc and along the shaft.
template <RealScalar Scalar>
struct Bend {
  Scalar arc = Scalar(0);
  Scalar length = Scalar(0);
};

/// What of a patch is in bone: the mean of its points' ways out, as vectors, by length and unit direction, and where it
/// acts (a patch that is half in bone pulls from there).
template <RealScalar Scalar>
struct PatchPull {
  Scalar way = Scalar(0);
  Vec3<Scalar> toward = Vec3<Scalar>::Zero();
  Scalar along = Scalar(0);    ///< from the vertex along the shaft [m]
  Scalar contact = Scalar(0);  ///< from there to where it touches: the mean way out, each by its own length [m]
};

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

  /// The patch's pull for a surface with outward unit normal n that lies `depth` [m] above the vertex along n
  /// (negative: below it) and bends by `bend`. `inward`: unit direction toward the centre; `axis`: the shaft's.
  ///
  /// At u on the patch h(u) = depth − n·u − (curvatures) is the depth, d(u) = d − u / r the direction inward and
  /// h / (n·d) the way out. The slope counts exactly, the curvatures of tool and bone by their means, d(u) at the
  /// centroid of h. (Inlined by force: g++ would call it, a sixth of a shaft's tick.)
  [[nodiscard, gnu::always_inline]] inline PatchPull<Scalar> pull(Scalar depth, const Vec3<Scalar>& n,
                                                                  const Vec3<Scalar>& inward, const Vec3<Scalar>& axis,
                                                                  const Bend<Scalar>& bend = {}) const noexcept {
    constexpr auto kLeastCosine = Scalar(0.1);
    const Scalar cosine = n.dot(inward);
    if (!(cosine > kLeastCosine)) return {};
    // Ways out converge toward the centre: at the bone the patch is smaller by this.
    const Scalar shrunk = Scalar(1) - std::clamp(depth / (cosine * radius), Scalar(0), Scalar(1));
    const Scalar sag = shrunk * shrunk;
    Scalar mean;            // of h
    Scalar square;          // mean of h²: of h times (its value at the vertex and its slopes times u and v)
    Vec3<Scalar> centroid;  // times the mean
    Scalar along = Scalar(0);
    if (disc > Scalar(0)) {
      const Vec3<Scalar> uphill = n - cosine * inward;
      const Scalar slope2 = disc * disc * uphill.squaredNorm();
      // Ways meet slanting bone farther apart: their distances' mean square grows by tan²/2 once all are in bone.
      const Scalar in_bone = std::min(depth > Scalar(0) ? depth * depth : Scalar(0), slope2);
      const Scalar slant = Scalar(1) + in_bone / (Scalar(2) * disc * disc * cosine * cosine);
      const Scalar s = depth - disc * disc * (cosine / radius + sag * slant * bend.arc) / Scalar(4);
      if (s * s >= slope2) {  // all of it in bone, or nothing: no root needed
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
      const Scalar s = depth - half_arc * half_arc * (cosine / radius + sag * bend.arc) / Scalar(6) -
                       half_length * half_length * bend.length / Scalar(6);
      const Scalar by_arc = -half_arc * n.dot(arc), by_length = -half_length * n.dot(axis);
      const PatchMoments<Scalar> m = moments_over_rectangle(s, by_arc, by_length);
      mean = m.mean;
      square = s * mean + by_arc * m.by_u + by_length * m.by_v;
      centroid = (half_arc * m.by_u) * arc;
      along = half_length * m.by_v;
    }
    if (!(mean > Scalar(0))) return {};
    const Scalar per_mean = Scalar(1) / mean;
    const Vec3<Scalar> toward = inward - (per_mean / radius) * centroid;
    const Scalar per_cosine = Scalar(1) / n.dot(toward);
    return {mean * per_cosine, (Scalar(1) / std::sqrt(toward.squaredNorm())) * toward, along * per_mean,
            square * per_mean * per_cosine};
  }
};

}  // namespace trephine
