// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/cholesky.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>

#include <limits>
#include <optional>

namespace trephine {

/// What a pose of the virtual tool amounts to: contact with its friction, and the coupling to the device.
struct PoseEnergy {
  FoundationSum contact;
  CouplingSum coupling;
  bool turns;      ///< the tool finds its rotation by itself
  bool conserves;  ///< without friction: forces are the energy's gradient

  [[nodiscard]] double energy() const noexcept { return contact.energy + coupling.energy; }
  /// −∂E by a small motion (δp, δθ) of the virtual tool.
  [[nodiscard]] Vec6d force() const noexcept {
    Vec6d f = contact.wrench + VirtualCoupling::wrench(coupling);
    if (!turns) f.tail<3>().setZero();
    return f;
  }
};

/// The small motion by which Newton's method goes on: with the exact second derivatives, or with Gauss and Newton's
/// part of them where the whole is not positive definite.
[[nodiscard]] inline Vec6d newton_step(const PoseEnergy& at, const VirtualCoupling& coupling) noexcept {
  Mat6d H = at.contact.stiffness, bending = at.contact.bending;
  coupling.add_curvature(at.coupling, H, bending);
  if (!at.turns) {
    H.bottomRows<3>().setZero();
    H.rightCols<3>().setZero();
    H.diagonal().tail<3>().setOnes();
    bending.bottomRows<3>().setZero();
    bending.rightCols<3>().setZero();
  }
  const Vec6d f = at.force();
  Vec6d step = Vec6d::Zero();
  if (!solve_positive_definite<6>(H + bending, f, step)) static_cast<void>(solve_positive_definite<6>(H, f, step));
  return step;
}

/// When a search ends.
struct SearchEnd {
  static constexpr int kMostSteps = 24;
  /// Evaluations in a search, and trials of the last step more, at most.
  static constexpr int kMostEvaluations = 64;
  double least;   ///< with a step smaller than this [m], of the part of the tool that moves most,
  double loaded;  ///< or than this where contact is as deep [m]
};

/// Where a search ended, or gave up.
struct Found {
  Posed X;        ///< after the last step
  PoseEnergy at;  ///< before the last step, what `last_step` moved since not included
  Vec6d last_step = Vec6d::Zero();
  double first_depth = 0;  ///< of the contact where the search began [m]
  int steps = 0;
  int evaluations = 0;
  bool met = false;    ///< bone, on the way
  bool ended = false;  ///< else it is to be carried on
};

/// Newton's method with an active set, that of the points that touch, toward the least energy of a pose.
///
/// `evaluate(X, ahead)` answers the energy at X for a tool that may go on by `ahead` [m], or nothing where bone is not
/// to be had yet; it is called for the pose that comes to stand in `Found` last.
template <class Evaluate>
class PoseSearch {
 public:
  PoseSearch(const VirtualCoupling& coupling, const Posed& X_device, const ToolBounds& bounds,
             Evaluate evaluate) noexcept
      : coupling_(coupling), X_device_(X_device), bounds_(bounds), evaluate_(evaluate) {}

  [[nodiscard]] Found from(const Posed& X, const SearchEnd& end) noexcept {
    Found f;
    f.X = X;
    if (!look(f, bounds_.motion_between(X, X_device_))) return f;
    f.first_depth = f.at.contact.depth;
    for (f.steps = 1; f.steps <= SearchEnd::kMostSteps && f.evaluations <= SearchEnd::kMostEvaluations; ++f.steps) {
      // Nothing touches here, nor on the way to the device.
      if (!f.at.contact.touches() && bounds_.motion_between(f.X, X_device_) <= f.at.contact.nearest) {
        f.X = X_device_;
        f.ended = true;
        return f;
      }
      const Vec6d step = newton_step(f.at, coupling_);
      const Posed X_next = moved(f.X, step);
      const double way = bounds_.motion_between(f.X, X_next);
      // A step as long as the contact is deep may end it.
      if (way + step.tail<3>().norm() * bounds_.radius <=
          std::max(end.least, std::min(end.loaded, f.at.contact.depth))) {
        f.X = X_next;
        f.last_step = step;
        f.ended = true;
        return f;
      }
      if (!descend(f, step, way)) return f;
    }
    return f;
  }

 private:
  static constexpr int kMostTrials = 8;
  /// A step ends where the energy's slope along it is between these shares of what it began with.
  static constexpr double kSteep = 0.5, kFlat = 0.9;
  /// Relative rise of the energy that is rounding.
  static constexpr double kRounding = 1e-9;

  [[nodiscard]] bool look(Found& f, double ahead) noexcept {
    const std::optional<PoseEnergy> at = evaluate_(f.X, ahead);
    if (!at) return false;
    ++f.evaluations;
    f.at = *at;
    f.met = f.met || at->contact.touches();
    return true;
  }

  /// Goes along the step, which moves the tool by `way`, to where the energy is lower and its slope small. No part of
  /// the tool goes farther than what is free and half of its core's radius. False where bone is not to be had yet.
  /// Stays where it is when it finds none.
  [[nodiscard]] bool descend(Found& f, const Vec6d& step, double way) noexcept {
    const double free = f.at.contact.nearest + bounds_.core_radius / 2, most = way > 0 ? free / way : 1.0;
    const Posed X = f.X;
    const double before = f.at.energy(), slope = -f.at.force().dot(step);
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double low = 0, low_slope = slope, high = kNone, high_slope = 0;
    double t = std::min(1.0, most);
    for (int trials = 0; trials < kMostTrials; ++trials) {
      f.X = moved(X, t * step);
      if (!look(f, (1 - t) * way)) {
        f.X = X;
        return false;
      }
      const double here = -f.at.force().dot(step);
      // Friction has no energy: whether its forces point back decides.
      const bool conserves = f.at.conserves;
      if ((conserves && f.at.energy() > before + kRounding * std::abs(before)) || here > -kSteep * slope) {
        high = t;
        high_slope = here;
      } else if (conserves && here < kFlat * slope && t < most && t < high) {
        low = t;
        low_slope = here;
      } else {
        return true;
      }
      if (high == kNone) {
        t = std::min(2 * t, most);
      } else {
        const double secant = high_slope > 0 ? low_slope / (low_slope - high_slope) : 0.5;
        t = low + std::clamp(secant, 0.1, 0.9) * (high - low);
      }
    }
    if (!f.at.conserves || f.at.energy() <= before) return true;
    f.X = X;
    return look(f, 0);
  }

  const VirtualCoupling& coupling_;
  const Posed& X_device_;
  const ToolBounds& bounds_;
  Evaluate evaluate_;
};

}  // namespace trephine
