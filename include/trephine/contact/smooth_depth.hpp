// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/near_vertices.hpp>
#include <trephine/contact/vertex_patch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trephine {

/// Smoothed depth at a place of the tool, in the field's units (`metres()` each): what its edges' crests keep straight
/// that cells notch.
template <RealScalar Scalar>
struct SmoothDepth {
  Vec3<Scalar> place;  ///< in T
  Scalar value = std::numeric_limits<Scalar>::lowest();
  Vec3<Scalar> rise;    ///< of `value`, in T axes
  Scalar plain;         ///< before sharpening; likewise
  Vec3<Scalar> smooth;  ///< its gradient, in G axes
  Mat3<Scalar> bend;    ///< its second derivatives
};

/// How a ball that bone holds goes on along a way [unit, G axes]: over round bone it rolls off, in a hollow it is led
/// back.
template <RealScalar Scalar>
struct Rolling {
  Vec3<Scalar> way = Vec3<Scalar>::Zero();
  Scalar bend = 0;  ///< ∂²φ/∂way² of its depth φ [1/m]
};

/// At place p of a tool at X. What smoothing blunts has a shorter gradient g, of length 1 elsewhere: part of it is
/// given back, .15 voxel times 1 − |g|², with its slope; more would notch crests as cells do.
template <PenetrationField Field, RealScalar Scalar>
[[nodiscard]] SmoothDepth<Scalar> sharpened(const Field& field, const Pose<Scalar>& X, const Vec3<Scalar>& p) noexcept {
  SmoothDepth<Scalar> there;
  there.place = p;
  there.plain = field.smooth(X * p, there.smooth, there.bend);
  const Scalar metres2 = field.metres() * field.metres();
  const Scalar given = Scalar(0.15) * field.voxel() / field.metres();
  there.value = there.plain + given * (Scalar(1) - metres2 * there.smooth.squaredNorm());
  there.rise = X.linear().transpose() * (there.smooth - (2 * given * metres2) * (there.bend * there.smooth));
  return there;
}

/// Newton's step on the ball to where it is deepest: normals are as exact as the place, to which the step may be of .3
/// voxel. Farther, or where bone bends away from it, a step of at most .6 voxel uphill. Returns whether the place was
/// reached; whatever it returns, `rolls` tell how the ball rolls over bone, or in it: of curvature κ there, ∂²φ/∂way²
/// is −1/(R + 1/κ). `voxel` in the field's units; the tool's axes are turned by R.
template <RealScalar Scalar>
bool settle(const VertexPatch<Scalar>& around, const Mat3<Scalar>& R, Scalar voxel, SmoothDepth<Scalar>& best,
            std::array<Rolling<Scalar>, 2>& rolls) noexcept {
  constexpr Scalar kWhole = Scalar(0.3), kStride = Scalar(0.6);  // [voxels]
  constexpr Scalar kFlat = Scalar(0.1);                          // curvature by the ball's that is none
  constexpr Scalar kRound = Scalar(0.9);                         // of a hollow at most: rounder holds no firmer
  rolls.fill({});
  const Vec3<Scalar> n = best.place / around.radius, u = n.unitOrthogonal(), v = n.cross(u);
  const Vec3<Scalar> u_G = R * u, v_G = R * v;
  const Scalar uu = -u_G.dot(best.bend * u_G), vv = -v_G.dot(best.bend * v_G), uv = -u_G.dot(best.bend * v_G);
  const Scalar along = best.rise.dot(n);
  if (!(along > Scalar(0))) return false;
  const Scalar steep = along / around.radius;
  const Scalar det = (uu + steep) * (vv + steep) - uv * uv;
  const Scalar rise_u = best.rise.dot(u), rise_v = best.rise.dot(v);
  const bool bent = uu + steep > Scalar(0) && det > Scalar(0);
  const Scalar to_u = bent ? ((vv + steep) * rise_u - uv * rise_v) / det : rise_u / steep;
  const Scalar to_v = bent ? ((uu + steep) * rise_v - uv * rise_u) / det : rise_v / steep;
  const Scalar far = std::sqrt(to_u * to_u + to_v * to_v);
  if (!(far < std::numeric_limits<Scalar>::max())) return false;
  const Scalar part = far > kStride * voxel ? kStride * voxel / far : Scalar(1);
  best.place = around.radius * Vec3<Scalar>(best.place + part * (to_u * u + to_v * v)).normalized();
  best.value += part * (2 - part) / 2 * (to_u * rise_u + to_v * rise_v);

  // Principal curvatures by the ball's, the greater first: half the sum and half the difference.
  const Scalar mean = (uu + vv) / 2, aside = (uu - vv) / 2, half = std::sqrt(aside * aside + uv * uv);
  const Scalar most = (mean + half) / steep, least = (mean - half) / steep;
  if (most > kFlat || least < -kFlat) {
    Scalar by_u = aside >= Scalar(0) ? aside + half : uv, by_v = aside >= Scalar(0) ? uv : half - aside;
    if (!(by_u != Scalar(0) || by_v != Scalar(0))) by_u = Scalar(1);
    const Scalar length = std::sqrt(by_u * by_u + by_v * by_v);
    const auto bend = [&](Scalar curvature) {
      const Scalar c = std::max(curvature, -kRound);
      return std::abs(c) > kFlat ? -c / ((Scalar(1) + c) * around.radius) : Scalar(0);
    };
    rolls = {Rolling<Scalar>{(by_u * u_G + by_v * v_G) / length, bend(most)},
             Rolling<Scalar>{(by_u * v_G - by_v * u_G) / length, bend(least)}};
  }
  return bent && far <= kWhole * voxel;
}

}  // namespace trephine
