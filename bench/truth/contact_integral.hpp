// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/wrench.hpp>
#include <trephine/tool/shape.hpp>

#include <array>
#include <functional>
#include <numbers>
#include <vector>

/// The Surface approximation with infinitely many vertices: its laws as integrals over ball and shaft, for a bone that
/// is a signed distance instead of voxels. What a number of vertices in a voxel image is measured against.
namespace trephine::bench {

/// Signed distance [m], negative in bone.
using Shape = std::function<double(const Vec3d&)>;

/// Integrals over the part of a surface that is in bone. a: way out toward the centre; d: unit direction there.
struct ContactIntegral {
  double area = 0;               ///< ∫ dA [m²]
  Vec3d spring = Vec3d::Zero();  ///< ∫ a d dA [m³]
  double weight = 0;             ///< ∫ a dA
  Vec3d point = Vec3d::Zero();   ///< ∫ a c dA, c the bone's surface at the end of the way: weight · mean contact
  Vec3d moment = Vec3d::Zero();  ///< ∫ (r_z × a d) dA about the tool's origin, r_z on the axis (Eq. 20)

  void add(double dA, double a, const Vec3d& d, const Vec3d& x, const Vec3d& lever) {
    area += dA;
    spring += dA * a * d;
    weight += dA * a;
    point += dA * a * (x + a * d);
    moment += dA * a * lever.cross(d);
  }
};

/// From x, in bone, along d to the first surface; `length` if there is none before.
[[nodiscard]] inline double way_out(const Shape& shape, const Vec3d& x, const Vec3d& d, double length) {
  constexpr int kSteps = 48;
  double lo = 0, hi = length, at_lo = shape(x), at_hi = 0;
  bool out = false;
  for (int i = 1; i <= kSteps && !out; ++i) {
    hi = length * i / kSteps;
    at_hi = shape(x + hi * d);
    out = at_hi > 0;
    if (!out) {
      lo = hi;
      at_lo = at_hi;
    }
  }
  if (!out) return length;
  int kept = 0;
  for (int i = 0; i < 60 && hi - lo > 1e-13; ++i) {
    const double t = lo + (hi - lo) * at_lo / (at_lo - at_hi);
    const double v = shape(x + t * d);
    if (v > 0) {
      hi = t;
      at_hi = v;
      if (kept == 1) at_lo /= 2;
      kept = 1;
    } else {
      lo = t;
      at_lo = v;
      if (kept == 2) at_hi /= 2;
      kept = 2;
    }
    if (std::abs(v) < 1e-14) return t;
  }
  return 0.5 * (lo + hi);
}

namespace detail {

inline constexpr std::array<double, 4> kGaussAt{0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                                                0.93056815579702629};
inline constexpr std::array<double, 4> kGaussWeight{0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                                    0.17392742256872693};

/// ∫ over the parts of [from, to] where `inside`, by Gauss–Legendre in `pieces` pieces of each part; part ends are
/// found among `scan` places and bisected. `f(t, weight)` takes the nodes.
template <class Inside, class F>
void integrate_inside(double from, double to, int scan, int pieces, const Inside& inside, const F& f) {
  const auto edge = [&](double in, double out) {
    for (int i = 0; i < 46; ++i) {
      const double mid = 0.5 * (in + out);
      (inside(mid) ? in : out) = mid;
    }
    return in;
  };
  double begin = from;
  bool was = inside(from);
  for (int i = 1; i <= scan; ++i) {
    const double t0 = from + (to - from) * (i - 1) / scan;
    const double t1 = from + (to - from) * i / scan;
    const bool is = inside(t1);
    if (is && !was) begin = edge(t1, t0);
    if ((was && !is) || (is && i == scan)) {
      const double end = is ? t1 : edge(t0, t1);
      const double h = (end - begin) / pieces;
      for (int p = 0; p < pieces; ++p)
        for (std::size_t g = 0; g < 4; ++g) f(begin + h * (p + kGaussAt[g]), h * kGaussWeight[g]);
    }
    was = is;
  }
}

}  // namespace detail

/// Of the ball at X_GT's origin. Polar coordinates round `deepest`, the direction from the centre to the deepest place:
/// where the bone is smooth there, the trapezoid in azimuth and Gauss–Legendre in the polar angle, up to where the ball
/// leaves the bone, converge faster than any power; tests/bench compares with closed forms.
[[nodiscard]] inline ContactIntegral ball_integral(const Shape& shape, const Posed& X_GT, double radius,
                                                   const Vec3d& deepest, int azimuths = 96) {
  ContactIntegral sum;
  const Vec3d c = X_GT.translation();
  const Vec3d u = deepest.unitOrthogonal(), v = deepest.cross(u);
  for (int i = 0; i < azimuths; ++i) {
    const double phi = 2 * std::numbers::pi * (i + 0.5) / azimuths;
    const Vec3d side = std::cos(phi) * u + std::sin(phi) * v;
    const auto out = [&](double theta) -> Vec3d { return std::cos(theta) * deepest + std::sin(theta) * side; };
    detail::integrate_inside(
        0, std::numbers::pi, 48, 4, [&](double theta) { return shape(c + radius * out(theta)) <= 0; },
        [&](double theta, double w) {
          const Vec3d d = -out(theta);
          const Vec3d x = c - radius * d;
          const double dA = w * radius * radius * std::sin(theta) * 2 * std::numbers::pi / azimuths;
          sum.add(dA, way_out(shape, x, d, radius), d, x, Vec3d::Zero());
        });
  }
  return sum;
}

/// Of a ring of the shaft's side at height z, per metre of shaft. `deepest`: azimuth about the axis where to begin.
[[nodiscard]] inline ContactIntegral ring_integral(const Shape& shape, const Posed& X_GT, double z, double radius,
                                                   double deepest) {
  ContactIntegral sum;
  const Vec3d centre = X_GT * Vec3d(0, 0, z);
  const Vec3d lever = z * X_GT.linear().col(2);
  const auto out = [&](double phi) -> Vec3d { return X_GT.linear() * Vec3d(std::cos(phi), std::sin(phi), 0); };
  // Begins opposite to the deepest place, so that what is in bone is in one piece.
  detail::integrate_inside(
      deepest - std::numbers::pi, deepest + std::numbers::pi, 48, 3,
      [&](double phi) { return shape(centre + radius * out(phi)) <= 0; },
      [&](double phi, double w) {
        const Vec3d d = -out(phi);
        const Vec3d x = centre - radius * d;
        sum.add(w * radius, way_out(shape, x, d, radius), d, x, lever);
      });
  return sum;
}

/// Azimuth about the shaft's axis of its deepest place at height z, and how deep that is [m] (<= 0: not in bone).
struct DeepestOnRing {
  double azimuth = 0;
  double depth = 0;
};
[[nodiscard]] inline DeepestOnRing deepest_on_ring(const Shape& shape, const Posed& X_GT, double z, double radius) {
  const auto depth = [&](double phi) {
    return -shape(X_GT * Vec3d(radius * std::cos(phi), radius * std::sin(phi), z));
  };
  DeepestOnRing best{0, depth(0)};
  for (int i = 1; i < 32; ++i) {
    const double phi = 2 * std::numbers::pi * i / 32;
    if (const double d = depth(phi); d > best.depth) best = {phi, d};
  }
  double lo = best.azimuth - 0.2, hi = best.azimuth + 0.2;
  constexpr double kGolden = 0.61803398874989485;
  for (int i = 0; i < 40; ++i) {
    const double a = hi - kGolden * (hi - lo), b = lo + kGolden * (hi - lo);
    (depth(a) > depth(b) ? hi : lo) = depth(a) > depth(b) ? b : a;
  }
  best.azimuth = 0.5 * (lo + hi);
  best.depth = depth(best.azimuth);
  return best;
}

/// Of the shaft's whole side, from where it leaves the ball to its end.
[[nodiscard]] inline ContactIntegral shaft_integral(const Shape& shape, const Posed& X_GT, const Burr& burr) {
  ContactIntegral sum;
  if (!burr.has_shaft()) return sum;
  const double r = burr.shaft_radius;
  detail::integrate_inside(
      burr.shaft_emerges(), burr.shaft_length, 240, 12,
      [&](double z) { return deepest_on_ring(shape, X_GT, z, r).depth >= 0; },
      [&](double z, double w) {
        const ContactIntegral ring = ring_integral(shape, X_GT, z, r, deepest_on_ring(shape, X_GT, z, r).azimuth);
        sum.area += w * ring.area;
        sum.spring += w * ring.spring;
        sum.weight += w * ring.weight;
        sum.point += w * ring.point;
        sum.moment += w * ring.moment;
      });
  return sum;
}

}  // namespace trephine::bench
