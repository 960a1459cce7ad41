// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>

#include <algorithm>
#include <cmath>

/// The spring between the device's pose and the virtual tool's (Colgate 1995; Wan and McNeely 2003).
namespace trephine {

/// Pull of a spring at an extension, with its derivative and its energy.
struct SpringPull {
  double pull = 0;     ///< [N] or [N·m]
  double tangent = 0;  ///< d pull / d extension
  double energy = 0;   ///< ∫ pull [J]
};

/// A spring of constant stiffness k up to its greatest pull, constant beyond: the pull is the gradient of an energy,
/// and bounded at once.
struct BoundedSpring {
  double stiffness = 1;
  double most = 0;

  [[nodiscard]] SpringPull at(double extension) const noexcept {
    const double bend = most / stiffness;
    if (extension <= bend) return {stiffness * extension, stiffness, 0.5 * stiffness * extension * extension};
    return {most, 0, most * (extension - 0.5 * bend)};
  }
};

/// The force of an elastic foundation on a ball that is pressed into a plane. Its pressure is k times the mean of
/// max(ψ − s, 0) over 0 <= s <= `ramp`, ψ the local depth (`FoundationLaw`), so at depth δ
///
///     P(δ) = π k (R − δ) (δ³ − v³) / (3 ramp),    v = max(δ − ramp, 0).
struct BallOnPlane {
  double gain;    ///< π k [N/m³]
  double radius;  ///< R [m]
  double ramp;    ///< [m], > 0

  [[nodiscard]] double force(double d) const noexcept {
    const double v = std::max(d - ramp, 0.0);
    return gain * (radius - d) * (d * d * d - v * v * v) / (3 * ramp);
  }
  /// dP / dδ [N/m].
  [[nodiscard]] double slope(double d) const noexcept {
    const double v = std::max(d - ramp, 0.0);
    return gain * ((radius - d) * (d * d - v * v) / ramp - (d * d * d - v * v * v) / (3 * ramp));
  }
  /// ∫ P dδ from 0 [J].
  [[nodiscard]] double energy(double d) const noexcept {
    const double v = std::max(d - ramp, 0.0);
    const auto part = [](double r, double x) { return x * x * x * x * (r / 4 - x / 5); };
    return gain * (part(radius, d) - part(radius - ramp, v)) / (3 * ramp);
  }
};

/// The coupling's spring made stiffer by as much as the contact yields, so that the two in series have the stiffness k.
/// Under P(δ) the spring's extension is
///
///     x(δ) = ε P / k                                    for δ <= δ_c,
///     x(δ) = ε P_c / k + (P − P_c) / k − (δ − δ_c)      beyond,
///
/// δ_c the depth from which the contact is stiff enough: P'(δ_c) = k / (1 − ε). The hand feels k beyond P_c, some
/// milli-newtons, and less below. `offset()` is how far outside the surface contact has to begin so that the felt force
/// is k times the depth below the surface.
class CompensatedSpring {
 public:
  CompensatedSpring() = default;
  /// k [N/m]; the contact's law; its depth at the greatest pull [m], where it must be stiffer than k.
  CompensatedSpring(double stiffness, const BallOnPlane& contact, double yield) noexcept
      : stiffness_(stiffness), contact_(contact), yield_(yield), most_(contact.force(yield)) {
    double low = 0, high = yield;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = (low + high) / 2;
      (contact.slope(middle) * (1 - kEpsilon) < stiffness ? low : high) = middle;
    }
    start_ = high;
    start_pull_ = contact.force(start_);
    most_extension_ = extension(yield_);
  }

  [[nodiscard]] double stiffness() const noexcept { return stiffness_; }
  [[nodiscard]] double most() const noexcept { return most_; }
  [[nodiscard]] double offset() const noexcept { return start_ - (1 - kEpsilon) * start_pull_ / stiffness_; }

  [[nodiscard]] SpringPull at(double x) const noexcept {
    if (!(x > kEpsilon * start_pull_ / stiffness_)) return BoundedSpring{stiffness_ / kEpsilon, most_}.at(x);
    double d = yield_;
    if (x < most_extension_) {
      // x(δ) bends upward, so that Newton's steps from above stay above. P = k (x + δ) at most, and gain (R − δ_m)
      // (δ − ramp / 2)² at least.
      const double least = contact_.gain * (contact_.radius - yield_);
      d = std::min(yield_, contact_.ramp / 2 + std::sqrt(stiffness_ * (x + yield_) / least));
      for (int i = 0; i < kMostSteps; ++i) {
        const double step = (extension(d) - x) / (contact_.slope(d) / stiffness_ - 1);
        d = std::max(d - step, start_);
        if (!(std::abs(step) > kRoot * d)) break;
      }
    }
    const double P = x < most_extension_ ? contact_.force(d) : most_;
    const double stored = (P * P - (1 - kEpsilon) * start_pull_ * start_pull_) / (2 * stiffness_) -
                          (contact_.energy(d) - contact_.energy(start_));
    return {P, x < most_extension_ ? 1 / (1 / stiffness_ - 1 / contact_.slope(d)) : 0,
            stored + most_ * std::max(0.0, x - most_extension_)};
  }

 private:
  static constexpr double kEpsilon = 0.25;
  static constexpr int kBisections = 60, kMostSteps = 20;
  static constexpr double kRoot = 1e-8;  // a step of this share leaves its square

  /// Beyond δ_c.
  [[nodiscard]] double extension(double d) const noexcept {
    return (contact_.force(d) - (1 - kEpsilon) * start_pull_) / stiffness_ - (d - start_);
  }

  double stiffness_ = 1;
  BallOnPlane contact_{1, 1, 1};
  double yield_ = 0;           // δ at the greatest pull [m]
  double most_ = 0;            // greatest pull [N]
  double start_ = 0;           // δ_c [m]
  double start_pull_ = 0;      // P_c [N]
  double most_extension_ = 0;  // [m]
};

/// The coupling of a virtual tool to the device at one pose, about the tool's origin, in G.
struct PoseError {
  Vec3d way = Vec3d::Zero();   ///< from the virtual tool to the device [m]
  Vec3d turn = Vec3d::Zero();  ///< likewise, a rotation vector [rad]
  SpringPull pull, twist;      ///< along them
  double energy = 0;           ///< [J]
};

/// The springs for translation and rotation. A tool that does not turn has the device's rotation.
struct VirtualCoupling {
  CompensatedSpring spring;
  BoundedSpring twister;
  bool turns = false;

  [[nodiscard]] PoseError at(const Posed& X, const Posed& X_device) const noexcept {
    PoseError s;
    s.way = X_device.translation() - X.translation();
    s.pull = spring.at(s.way.norm());
    s.energy = s.pull.energy;
    if (!turns) return s;
    s.turn = turn_between(X, X_device);
    s.twist = twister.at(s.turn.norm());
    s.energy += s.twist.energy;
    return s;
  }

  /// On the virtual tool, so −∂E; the hand feels the opposite.
  [[nodiscard]] static Vec6d wrench(const PoseError& s) noexcept {
    const double way = s.way.norm(), turn = s.turn.norm();
    Vec6d f = Vec6d::Zero();
    if (way > 0) f.head<3>() = s.pull.pull / way * s.way;
    if (turn > 0) f.tail<3>() = s.twist.pull / turn * s.turn;
    return f;
  }

  /// Adds ∂²E, which is positive, to `stiffness`, and to `bending` how a turn moves the rest of the turn.
  void add_curvature(const PoseError& s, Mat6d& stiffness, Mat6d& bending) const noexcept {
    const double way = s.way.norm();
    const double secant = way > 0 ? s.pull.pull / way : s.pull.tangent;
    // A pull that grows no more has no stiffness along it: the secant keeps steps bounded, and downhill.
    const double along = s.pull.tangent > 0 ? s.pull.tangent : secant;
    const Vec3d d = way > 0 ? Vec3d(s.way / way) : Vec3d(Vec3d::Zero());
    stiffness.topLeftCorner<3, 3>() += outer(along - secant, d, d);
    stiffness.diagonal().head<3>().array() += secant;
    if (!turns) return;
    const double turn = s.turn.norm();
    const double k = turn > 0 ? s.twist.pull / turn : twister.stiffness;
    // Second derivative of ½|log|²: 1 along the turn, (φ/2) cot (φ/2) across.
    const double across = turn > 1e-4 ? (turn / 2) / std::tan(turn / 2) : 1.0;
    const Vec3d a = turn > 0 ? Vec3d(s.turn / turn) : Vec3d(Vec3d::Zero());
    stiffness.diagonal().tail<3>().array() += k;
    bending.bottomRightCorner<3, 3>() += outer(k * (1 - across), a, a);
    bending.diagonal().tail<3>().array() -= k * (1 - across);
  }
};

}  // namespace trephine
