// SPDX-License-Identifier: MIT
#pragma once

#include "support/raster.hpp"

#include <trephine/tool/shape.hpp>

/// Exact answers for a shaft in a bone that is a signed distance, by brute force in double.
namespace trephine::test {

/// How deep the centreline from `tip` along d is in bone [m], and at which height.
template <class Shape>
double deepest_on_line(const Shape& shape, const Burr& burr, const Vec3d& tip, const Vec3d& d,
                       double* height = nullptr) {
  double deepest = -1e9, at = 0;
  constexpr int kPoints = 400;
  const double from = burr.tip_radius, step = (burr.shaft_length - from) / kPoints;
  for (int i = 0; i <= kPoints; ++i) {
    const double depth = -shape(tip + (from + step * i) * d);
    if (!(depth > deepest)) continue;
    deepest = depth;
    at = from + step * i;
  }
  if (height != nullptr) {
    // Between the places looked at: a parabola through the deepest and its neighbours.
    const auto depth = [&](double h) { return -shape(tip + h * d); };
    const double below = depth(at - step), here = depth(at), above = depth(at + step);
    const double bend = below - 2 * here + above;
    *height = std::clamp(bend < 0 ? at + 0.5 * step * (below - above) / bend : at, from, burr.shaft_length);
  }
  return deepest;
}

struct ExactLine {
  Vec3d direction;
  Vec3d contact;
};

/// The direction nearest to s that keeps a rigid line through `tip` out of bone, sought around `guess` within `span`
/// (tangents of angles) in nine levels of refinement, and where that line touches.
template <class Shape>
ExactLine constrained_line(const Shape& shape, const Burr& burr, const Vec3d& tip, const Vec3d& s, const Vec3d& guess,
                           double span) {
  const Vec3d u = s.unitOrthogonal(), v = s.cross(u);
  const Vec3d g = guess.normalized();
  double cu = g.dot(u) / g.dot(s), cv = g.dot(v) / g.dot(s);
  Vec3d best = g;
  double least = 1e9;
  for (int level = 0; level < 9; ++level, span /= 3) {
    const double mu = cu, mv = cv;
    for (int i = -10; i <= 10; ++i)
      for (int j = -10; j <= 10; ++j) {
        const double a = mu + span * i / 10, b = mv + span * j / 10;
        const Vec3d d = (s + a * u + b * v).normalized();
        const double angle = std::atan2(d.cross(s).norm(), d.dot(s));
        if (!(angle < least) || deepest_on_line(shape, burr, tip, d) > 0) continue;
        least = angle;
        best = d;
        cu = a;
        cv = b;
      }
  }
  double height = 0;
  deepest_on_line(shape, burr, tip, best, &height);
  return {best, tip + height * best};
}

/// Depth [m] of the deepest of 32 places round the shaft's side at height z; negative: all are clear by that much.
template <class Shape>
double ring_depth(const Shape& shape, const Posed& X_GT, double z, double radius) {
  double deepest = -1e9;
  for (int i = 0; i < 32; ++i) {
    const double phi = 0.19634954084936207 * i;
    deepest = std::max(deepest, -shape(X_GT * Vec3d(radius * std::cos(phi), radius * std::sin(phi), z)));
  }
  return deepest;
}

struct DeepestOnShaft {
  Vec3d point = Vec3d::Zero();
  double depth = -1e9;
};

/// The deepest place of the shaft's side: the best of a grid, refined by shrinking steps.
template <class Shape>
DeepestOnShaft deepest_on_shaft(const Shape& shape, const Posed& X_GT, const Burr& burr) {
  double z = 0, phi = 0;
  const auto at = [&](double height, double angle) -> Vec3d {
    return X_GT * Vec3d(burr.shaft_radius * std::cos(angle), burr.shaft_radius * std::sin(angle), height);
  };
  DeepestOnShaft best;
  const auto look = [&](double height, double angle) {
    if (height < burr.shaft_emerges() || height > burr.shaft_length) return;
    const Vec3d p = at(height, angle);
    const double depth = -shape(p);
    if (!(depth > best.depth)) return;
    best = {p, depth};
    z = height;
    phi = angle;
  };
  for (int i = 0; i <= 120; ++i)
    for (int j = 0; j < 16; ++j)
      look(burr.shaft_emerges() + (burr.shaft_length - burr.shaft_emerges()) * i / 120, 0.39269908169872414 * j);
  for (double step = 0.5; step > 1e-7; step /= 2)
    for (int again = 0; again < 3; ++again) {
      const double z0 = z, phi0 = phi;
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j) look(z0 + i * step * 1e-3, phi0 + j * step);
    }
  return best;
}

}  // namespace trephine::test
