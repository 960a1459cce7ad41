// SPDX-License-Identifier: MIT
#pragma once

#include "support/fields.hpp"

#include <trephine/contact/surface_proxy.hpp>

namespace trephine::test {

inline constexpr double kVoxel = 3e-4;  ///< [m] of every grid in these tests unless it says otherwise

/// Moves the probe in a straight line, `step` metres a tick at most, and returns the worst status on the way.
template <class Proxy, class Field>
Status lead(Proxy& proxy, const Field& field, const Vec3d& from, const Vec3d& to, double step) {
  using Scalar = typename Field::Scalar;
  const int n = std::max(1, static_cast<int>(std::ceil((to - from).norm() / step)));
  Status worst = Status::kOk;
  for (int i = 0; i <= n; ++i) {
    const Vec3d p = from + (static_cast<double>(i) / n) * (to - from);
    worst = worse(worst, proxy.follow(field, Vec3<Scalar>(p.template cast<Scalar>())));
  }
  return worst;
}

/// Keeps the probe at p for `ticks`.
template <class Proxy, class Field>
Status rest(Proxy& proxy, const Field& field, const Vec3d& p, int ticks) {
  using Scalar = typename Field::Scalar;
  Status worst = Status::kOk;
  for (int i = 0; i < ticks; ++i) worst = worse(worst, proxy.follow(field, Vec3<Scalar>(p.template cast<Scalar>())));
  return worst;
}

/// How far the proxy moves in `ticks` more of the same probe [voxels].
template <class Proxy, class Field>
double restlessness(Proxy& proxy, const Field& field, const Vec3d& p, int ticks) {
  const Vec3d start = proxy.position().template cast<double>();
  double most = 0;
  for (int i = 0; i < ticks; ++i) {
    static_cast<void>(rest(proxy, field, p, 1));
    most =
        std::max(most, (proxy.position().template cast<double>() - start).norm() / static_cast<double>(field.voxel()));
  }
  return most;
}

/// Oracle: the free point of a shape that is nearest to p, by minimising over a shrinking lattice round a first guess
/// (a coarse lattice over the box). Slow, in double, no gradients.
template <class Shape>
Vec3d nearest_free(const Shape& shape, const Vec3d& p, const Vec3d& lo, const Vec3d& hi) {
  constexpr int kN = 16;
  Vec3d best = Vec3d::Zero(), from = lo, to = hi;
  double least = 1e9;
  for (int level = 0; level < 14; ++level) {
    for (int k = 0; k <= kN; ++k)
      for (int j = 0; j <= kN; ++j)
        for (int i = 0; i <= kN; ++i) {
          const Vec3d q = from + (to - from).cwiseProduct(Vec3d(i, j, k)) / kN;
          const double d = (q - p).squaredNorm();
          if (!(d < least) || !(shape(q) >= 0)) continue;
          least = d;
          best = q;
        }
    const Vec3d half = (to - from) * (level == 0 ? 2.0 : 3.0) / kN;
    from = best - half;
    to = best + half;
  }
  return best;
}

}  // namespace trephine::test
