// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>

/// Mechanics of a SimulatedDevice: the exact step of a damped oscillator, Coulomb friction, quantisation and
/// saturation. Translation and rotation use the same functions.
namespace trephine::inline TREPHINE_ALIGNED::simulated {

/// The exact step over h seconds of  M ẍ + B ẋ + K (x − x_d) = u  with x_d and u held (a zero-order hold), on
/// e = x − x_d and v = ẋ. Valid for any B, K >= 0: free, under-, over- or critically damped.
class ZeroOrderHoldStep {
 public:
  ZeroOrderHoldStep() = default;

  /// Computes the matrix exponential of the system with its input appended, by scaling and squaring. The Taylor series
  /// to order 14 on a norm below 1/4 errs by less than 1e-19. Allocates nothing; takes about a microsecond.
  ZeroOrderHoldStep(double h, double M, double B, double K) noexcept {
    Mat3d A;
    A << 0, h, 0, -K / M * h, -B / M * h, h / M, 0, 0, 0;
    int squarings = 0;
    for (double norm = A.cwiseAbs().rowwise().sum().maxCoeff(); norm > kMaxNorm && squarings < kMaxSquarings;
         norm *= 0.5)
      ++squarings;
    A *= std::ldexp(1.0, -squarings);
    // Stores and squares E = exp(A) - I, so that small steps are not lost next to the identity.
    Mat3d E = A;
    Mat3d term = A;
    for (int n = 2; n <= kOrder; ++n) {
      term = Mat3d(term * A) / n;
      E += term;
    }
    for (int i = 0; i < squarings; ++i) E = Mat3d(E * E) + 2.0 * E;
    E_ = E;
  }

  /// Returns the displacement over the step for e, v and the held input u.
  [[nodiscard]] Vec3d displacement(const Vec3d& e, const Vec3d& v, const Vec3d& u) const noexcept {
    return E_(0, 0) * e + E_(0, 1) * v + E_(0, 2) * u;
  }
  /// Returns the velocity after the step.
  [[nodiscard]] Vec3d velocity(const Vec3d& e, const Vec3d& v, const Vec3d& u) const noexcept {
    return v + E_(1, 0) * e + E_(1, 1) * v + E_(1, 2) * u;
  }

 private:
  // Numbers that decide the error of the exponential: below 1e-19.
  static constexpr double kMaxNorm = 0.25;  // of the scaled matrix
  static constexpr int kOrder = 14;         // of the Taylor series
  static constexpr int kMaxSquarings = 60;  // bounds the work for absurd parameters

  Mat3d E_ = Mat3d::Zero();
};

/// Runs one substep with Coulomb friction of magnitude `friction` against the motion; returns the displacement and
/// updates `v`. Stiction follows Karnopp (1985), with a velocity band as wide as the change by friction in one substep.
/// A body whose velocity would reverse stops; it leaves rest only if the other forces exceed the friction. `stiffness`
/// is the K of the step, e = x − x_d, and u the held force.
[[nodiscard]] inline Vec3d substep(const ZeroOrderHoldStep& step, double stiffness, double friction, const Vec3d& e,
                                   Vec3d& v, const Vec3d& u) noexcept {
  if (!(friction > 0)) {
    const Vec3d displacement = step.displacement(e, v, u);
    v = step.velocity(e, v, u);
    return displacement;
  }
  Vec3d direction = v;
  if (v.squaredNorm() <= 0) {
    direction = u - stiffness * e;
    if (!(direction.norm() > friction)) return Vec3d::Zero();
  }
  direction /= direction.norm();
  const Vec3d input = u - friction * direction;
  Vec3d displacement = step.displacement(e, v, input);
  v = step.velocity(e, v, input);
  if (!(v.dot(direction) > 0)) {
    v.setZero();
    if (displacement.dot(direction) < 0) displacement.setZero();
  }
  return displacement;
}

/// Returns x with each component rounded to a multiple of `quantum`; unchanged for a quantum of 0.
[[nodiscard]] inline Vec3d quantised(const Vec3d& x, double quantum) noexcept {
  if (!(quantum > 0)) return x;
  return {quantum * std::round(x.x() / quantum), quantum * std::round(x.y() / quantum),
          quantum * std::round(x.z() / quantum)};
}

/// Returns x shortened to length `limit`, direction kept; unchanged for a limit of 0.
[[nodiscard]] inline Vec3d saturated(const Vec3d& x, double limit) noexcept {
  const double norm = std::hypot(x.x(), x.y(), x.z());
  return limit > 0 && norm > limit ? Vec3d(x * (limit / norm)) : x;
}

}  // namespace trephine::simulated
