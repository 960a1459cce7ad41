// SPDX-License-Identifier: MIT
#pragma once

#include "drill_cell.hpp"
#include "support/random.hpp"

#include <cmath>

namespace robots::test {

using trephine::test::Random;

/// A hand that wants the nerve: pushes of up to 30 N and 3 N·m that step, swing, turn and rest, most of them toward it.
class HostileHand {
 public:
  explicit HostileHand(unsigned seed) : random_(seed) {}

  [[nodiscard]] Wrenchd push(const Posed& X_WT, double time) {
    if (--left_ < 0) choose(X_WT);
    const double swing = frequency_ > 0 ? std::sin(6.283185307179586 * frequency_ * time) : 1.0;
    const Vec3d home = Vec3d(12e-3, 12e-3, 9e-3) - X_WT.translation();
    Vec3d f = swing * force_;
    if (seeks_) f += strength_ * to_nerve(X_WT).normalized();
    if (home.norm() > 0.03) f = 30 * home.normalized();
    return {f.norm() > 30 ? Vec3d(30 / f.norm() * f) : f, swing * torque_};
  }

 private:
  [[nodiscard]] static Vec3d to_nerve(const Posed& X_WT) {
    const Vec3d p = X_WT.translation();
    return Vec3d(0, 12e-3 - p.y(), 9e-3 - p.z());
  }
  void choose(const Posed& X_WT) {
    left_ = 1 + random_.below(random_.below(3) == 0 ? 10 : 400);
    force_ = random_.arrow(0, 30);
    torque_ = random_.below(2) == 0 ? Vec3d(Vec3d::Zero()) : random_.arrow(0, 3);
    frequency_ = random_.below(2) == 0 ? 0 : random_.uniform(0.2, 100);
    seeks_ = random_.below(4) > 0;
    strength_ = random_.uniform(0, 30);
    // The shaft against the nerve: turn it by its end.
    if (random_.below(4) == 0) torque_ = 3 * z_axis(X_WT).cross(to_nerve(X_WT)).normalized();
  }

  Random random_;
  int left_ = 0;
  Vec3d force_ = Vec3d::Zero(), torque_ = Vec3d::Zero();
  double frequency_ = 0, strength_ = 0;
  bool seeks_ = false;
};

}  // namespace robots::test
