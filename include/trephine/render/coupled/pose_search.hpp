// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/cholesky.hpp>
#include <trephine/render/coupled/bristles.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>

#include <limits>
#include <optional>

namespace trephine {

/// What a pose of the virtual tool amounts to: contact, its friction, and the coupling to the device.
struct PoseEnergy {
  FoundationSum contact;
  FrictionSum friction;  ///< no part of the energy
  PoseError coupling;
  bool turns = false;  ///< the tool finds its rotation by itself

  [[nodiscard]] double energy() const noexcept { return contact.energy + coupling.energy; }
  /// Force and torque on the virtual tool; −∂E by a small motion (δp, δθ) but for friction.
  [[nodiscard]] Vec6d force() const noexcept {
    Vec6d f = contact.wrench + friction.wrench + VirtualCoupling::wrench(coupling);
    if (!turns) f.tail<3>().setZero();
    return f;
  }
};

/// Second derivatives of the energy by a small motion: with the tool's bending, or Gauss and Newton's part of them
/// alone. A tool that does not turn has ones where turns are.
struct Curvature {
  Mat6d whole, gauss_newton;

  Curvature(const PoseEnergy& at, const VirtualCoupling& coupling) noexcept {
    Mat6d H = at.contact.stiffness, bending = at.contact.bending;
    coupling.add_curvature(at.coupling, H, bending);
    gauss_newton = symmetric(H);
    whole = symmetric(H + bending);
    if (at.turns) return;
    hold_turns(gauss_newton);
    hold_turns(whole);
  }
  static void hold_turns(Mat6d& m) noexcept {
    m.bottomRows<3>().setZero();
    m.rightCols<3>().setZero();
    m.diagonal().tail<3>().setOnes();
  }
};

/// The small motion by which Newton's method goes on.
[[nodiscard]] inline Vec6d newton_step(const PoseEnergy& at, const Curvature& curvature) noexcept {
  const Vec6d f = at.force();
  Vec6d step = Vec6d::Zero();
  if (!solve_positive_definite<6>(curvature.whole, f, step))
    static_cast<void>(solve_positive_definite<6>(curvature.gauss_newton, f, step));
  return step;
}

/// The same with friction, which is no smooth function of the motion: Newton's method on the linear model of contact
/// and coupling with `friction.at(motion)`, from `guess` on, until a step is smaller than `enough` [m] for a point that
/// is `arm` [m] away.
template <class FrictionAt>
[[nodiscard]] Vec6d newton_step(const PoseEnergy& at, const Curvature& curvature, const FrictionAt& friction,
                                const Vec6d& guess, double arm, double enough) noexcept {
  constexpr int kMostSteps = 6;
  Vec6d f = at.contact.wrench + VirtualCoupling::wrench(at.coupling), motion = guess;
  if (!at.turns) {
    f.tail<3>().setZero();
    motion.tail<3>().setZero();
  }
  for (int i = 0; i < kMostSteps; ++i) {
    const FrictionSum s = i == 0 && motion == Vec6d::Zero() ? at.friction : friction.at(motion);
    Vec6d left = f + s.wrench - curvature.whole * motion;
    Mat6d stiffness = s.stiffness;
    if (!at.turns) {
      left.tail<3>().setZero();
      stiffness.bottomRows<3>().setZero();
      stiffness.rightCols<3>().setZero();
    }
    Vec6d step = Vec6d::Zero();
    if (!solve_linear<6>(curvature.whole + stiffness, left, step)) break;
    motion += step;
    if (step.head<3>().norm() + step.tail<3>().norm() * arm <= enough) break;
  }
  return motion.dot(at.force()) > 0 ? motion : newton_step(at, curvature);
}

/// When a search ends.
struct SearchTolerance {
  static constexpr int kMostSteps = 24;
  /// Evaluations in a search, and trials of the last step more, at most.
  static constexpr int kMostEvaluations = 64;
  double least;  ///< with a step smaller than this [m], of the part of the tool that moves most,
  double left;   ///< or where the next would be smaller than this [m]
};

/// Where a search ended, or gave up.
struct SearchResult {
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
/// `evaluate(X, ahead)` answers the energy at X for a tool that may go on by `ahead`, or nothing where bone is not to
/// be had yet; it is called for the pose that comes to stand in `SearchResult` last. `friction` answers for the points
/// found there.
template <class Evaluate, class FrictionAt>
class PoseSearch {
 public:
  PoseSearch(const VirtualCoupling& coupling, const Posed& X_device, const ToolBounds& bounds, Evaluate evaluate,
             const FrictionAt& friction) noexcept
      : coupling_(coupling), X_device_(X_device), bounds_(bounds), evaluate_(evaluate), friction_(friction) {}

  /// `guess`: the motion from X to where the search may end, for friction.
  [[nodiscard]] SearchResult from(const Posed& X, const SearchTolerance& end, Vec6d guess) noexcept {
    SearchResult f;
    f.X = X;
    if (!evaluate_at(f, motion_between(X, X_device_))) return f;
    f.first_depth = f.at.contact.depth;
    double before = 0;  // size of the last step
    for (f.steps = 1; f.steps <= SearchTolerance::kMostSteps && f.evaluations <= SearchTolerance::kMostEvaluations;
         ++f.steps) {
      // Nothing touches here, nor on the way to the device.
      if (!f.at.contact.touches() && f.at.contact.clearance.max_step_fraction(motion_between(f.X, X_device_)) >= 1) {
        f.X = X_device_;
        f.ended = true;
        return f;
      }
      const Curvature curvature(f.at, coupling_);
      const Vec6d step =
          friction_.holds() && f.at.contact.touches()
              ? newton_step(f.at, curvature, friction_, guess, bounds_.arm(), std::max(end.least, end.left))
              : newton_step(f.at, curvature);
      guess.setZero();
      const Posed X_next = moved(f.X, step);
      const ToolMotion way = motion_between(f.X, X_next);
      const double size = way.at(bounds_.arm()) + step.tail<3>().norm() * bounds_.radius;
      // Steps shrink at least as quickly as these two, unless contact began between them. A last step is no longer than
      // the contact is deep.
      const double left = size * std::min(1.0, size / before);
      before = f.at.contact.touches() ? size : 0;
      if (size <= end.least || (size <= f.at.contact.depth && left <= end.left)) {
        f.X = X_next;
        f.last_step = step;
        f.ended = true;
        return f;
      }
      if (!line_search(f, step, way)) return f;
    }
    return f;
  }

 private:
  static constexpr int kMostTrials = 8;
  /// A step ends where the energy's slope along it is between these shares of what it began with.
  static constexpr double kSteep = 0.5, kFlat = 0.9;
  /// Relative rise of the energy that is rounding.
  static constexpr double kRounding = 1e-9;

  [[nodiscard]] bool evaluate_at(SearchResult& f, const ToolMotion& ahead) noexcept {
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
  [[nodiscard]] bool line_search(SearchResult& f, const Vec6d& step, const ToolMotion& way) noexcept {
    const double most = f.at.contact.clearance.max_step_fraction(way, bounds_.core_radius / 2);
    const Posed X = f.X;
    const double before = f.at.energy(), slope = -f.at.force().dot(step);
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double low = 0, low_slope = slope, high = kNone, high_slope = 0;
    double t = std::min(1.0, most);
    for (int trials = 0; trials < kMostTrials; ++trials) {
      f.X = moved(X, t * step);
      if (!evaluate_at(f, {(1 - t) * way.shift, (1 - t) * way.turn})) {
        f.X = X;
        return false;
      }
      const double here = -f.at.force().dot(step);
      // Friction has no energy: whether its forces point back decides.
      const bool conserves = !friction_.holds();
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
    if (friction_.holds() || f.at.energy() <= before) return true;
    f.X = X;
    return evaluate_at(f, {});
  }

  const VirtualCoupling& coupling_;
  const Posed& X_device_;
  const ToolBounds& bounds_;
  Evaluate evaluate_;
  const FrictionAt& friction_;
};

}  // namespace trephine
