// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/core/wrench.hpp>

#include <algorithm>

namespace trephine::test {

/// What a wrench on a tool does along a path of poses, by the trapezoid rule: the net work of a closed path is energy
/// that the loop gives to the hand.
class PathWork {
 public:
  PathWork(const Posed& X, const Wrenchd& w) : X_(X), w_(w) {}

  /// On to the next pose, and the wrench there.
  void go(const Posed& X, const Wrenchd& w) {
    const Vec3d dx = X.translation() - X_.translation();
    const Vec3d dr = turn_between(X_, X);
    const Vec3d f = 0.5 * (w_.force + w.force), t = 0.5 * (w_.torque + w.torque);
    net += f.dot(dx) + t.dot(dr);
    length += f.norm() * dx.norm() + t.norm() * dr.norm();
    jump = std::max(jump, (w.force - w_.force).norm());
    X_ = X;
    w_ = w;
  }

  double net = 0;     ///< ∫ F·dx + T·dθ [J]
  double length = 0;  ///< ∫ |F||dx| + |T||dθ| [J]
  double jump = 0;    ///< largest change of the force in a step [N]

 private:
  Posed X_;
  Wrenchd w_;
};

}  // namespace trephine::test
