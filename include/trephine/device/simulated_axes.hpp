// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>

/// The mechanics inside `SimulatedDevice`, the same for its translation and its rotation.
namespace trephine::simulated {

/// The exact step over h seconds of  M ẍ + B ẋ + K (x − x_d) = u  with x_d and u held (a zero-order hold), on
/// e = x − x_d and v = ẋ. Any B, K >= 0: free, under-, over- or critically damped.
class HeldStep {
 public:
  HeldStep() = default;

  /// Matrix exponential of the system with its input appended: Taylor to order 14 on a norm below 1/4 (error below
  /// 1e-19), squared back. Allocates nothing; about a microsecond.
  HeldStep(double h, double M, double B, double K) noexcept {
    Mat3d A;
    A << 0, h, 0, -K / M * h, -B / M * h, h / M, 0, 0, 0;
    int squarings = 0;
    for (double norm = A.cwiseAbs().rowwise().sum().maxCoeff(); norm > 0.25 && squarings < 60; norm *= 0.5) ++squarings;
    A *= std::ldexp(1.0, -squarings);
    // E = exp(A) - I is what is kept and squared, so that small steps do not drown in the identity.
    Mat3d E = A;
    Mat3d term = A;
    for (int n = 2; n <= 14; ++n) {
      term = Mat3d(term * A) / n;
      E += term;
    }
    for (int i = 0; i < squarings; ++i) E = Mat3d(E * E) + 2.0 * E;
    E_ = E;
  }

  [[nodiscard]] Vec3d moved(const Vec3d& e, const Vec3d& v, const Vec3d& u) const noexcept {
    return E_(0, 0) * e + E_(0, 1) * v + E_(0, 2) * u;
  }
  [[nodiscard]] Vec3d velocity(const Vec3d& e, const Vec3d& v, const Vec3d& u) const noexcept {
    return v + E_(1, 0) * e + E_(1, 1) * v + E_(1, 2) * u;
  }

 private:
  Mat3d E_ = Mat3d::Zero();
};

/// One substep with Coulomb friction of magnitude `friction` against the motion; returns how far it went and updates
/// `v`. Stiction after Karnopp (1985), his velocity band being what friction takes away in one substep: a body whose
/// velocity would turn stops, and leaves rest only when the other forces exceed the friction.
/// `stiffness` is the K of the step, e = x − x_d, u the held force.
[[nodiscard]] inline Vec3d substep(const HeldStep& step, double stiffness, double friction, const Vec3d& e, Vec3d& v,
                                   const Vec3d& u) noexcept {
  if (!(friction > 0)) {
    const Vec3d moved = step.moved(e, v, u);
    v = step.velocity(e, v, u);
    return moved;
  }
  Vec3d along = v;
  if (v.squaredNorm() <= 0) {
    along = u - stiffness * e;
    if (!(along.norm() > friction)) return Vec3d::Zero();
  }
  along /= along.norm();
  const Vec3d driven = u - friction * along;
  Vec3d moved = step.moved(e, v, driven);
  v = step.velocity(e, v, driven);
  if (!(v.dot(along) > 0)) {
    v.setZero();
    if (moved.dot(along) < 0) moved.setZero();
  }
  return moved;
}

/// Each component rounded to a whole number of quanta; 0: as it is.
[[nodiscard]] inline Vec3d quantised(const Vec3d& x, double quantum) noexcept {
  if (!(quantum > 0)) return x;
  return {quantum * std::round(x.x() / quantum), quantum * std::round(x.y() / quantum),
          quantum * std::round(x.z() / quantum)};
}

/// `x` shortened to length `limit`, direction kept; 0: no limit.
[[nodiscard]] inline Vec3d saturated(const Vec3d& x, double limit) noexcept {
  const double norm = std::hypot(x.x(), x.y(), x.z());
  return limit > 0 && norm > limit ? Vec3d(x * (limit / norm)) : x;
}

}  // namespace trephine::simulated
