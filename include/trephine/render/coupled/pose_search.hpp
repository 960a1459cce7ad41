// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/cholesky.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/render/coupled/bristles.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace trephine::inline TREPHINE_ALIGNED {

/// Evaluation of a pose of the virtual tool: contact with bone and load, friction, and the coupling to the device.
struct PoseEvaluation {
  FoundationSum contact;
  FrictionSum friction;  ///< no part of the energy
  PoseError coupling;
  bool solves_rotation = false;  ///< false: the tool has the device's rotation, and wrench() no torque
  double load_depth = 0;         ///< of a load, which is in the sums of `contact` [m]

  /// Energy of contact and coupling [J].
  [[nodiscard]] double energy() const noexcept { return contact.energy + coupling.energy; }
  /// Force [N] and torque [N·m] on the virtual tool: friction, and −∂E by a small motion (δp, δθ).
  [[nodiscard]] Vec6d wrench() const noexcept {
    Vec6d f = contact.wrench + friction.wrench + VirtualCoupling::wrench(coupling);
    if (!solves_rotation) clear_angular(f);
    return f;
  }
};

/// Hessian of the energy by a small motion: in full, and its Gauss–Newton part. A tool whose rotation is not solved for
/// has the identity in the rotation block.
struct PoseHessian {
  Mat6d full, gauss_newton;

  PoseHessian(const PoseEvaluation& at, const VirtualCoupling& coupling) noexcept {
    Mat6d H = at.contact.stiffness, geometric_stiffness = at.contact.geometric_stiffness;
    coupling.add_hessian(at.coupling, H, geometric_stiffness);
    gauss_newton = symmetric(H);
    full = symmetric(H + geometric_stiffness);
    if (at.solves_rotation) return;
    fix_rotation(gauss_newton);
    fix_rotation(full);
  }
  static void fix_rotation(Mat6d& m) noexcept {
    clear_angular(m);
    add_to_diagonal(m, 3, 1);
  }
};

/// Newton step on the energy: the small motion to the minimum of its quadratic model. Returns the Gauss–Newton step if
/// the Hessian is not positive definite.
[[nodiscard]] inline Vec6d newton_step(const PoseEvaluation& at, const PoseHessian& hessian) noexcept {
  const Vec6d f = at.wrench();
  Vec6d step = Vec6d::Zero();
  if (!solve_positive_definite<6>(hessian.full, f, step))
    static_cast<void>(solve_positive_definite<6>(hessian.gauss_newton, f, step));
  return step;
}

/// Size of the step after one of size `size`, if steps shrink by the ratio of the last two at least. A `previous` step
/// of 0 predicts nothing: the next step may be as large as this.
[[nodiscard]] inline double next_step_size(double size, double previous) noexcept {
  return size * std::min(1.0, size / previous);
}

/// Returns the way back along a step, in fractions of it, from a pose that went too far to where contact and coupling
/// balance. The coupling pulls with `pull` along the step, and with `pull_growth` more a whole step farther back. Not
/// finite if the contact's energy does not grow along the step.
///
/// The energy E of contact grows as a power p + 1 of the way τ since contact began. So its slope f and curvature c tell
/// τ = 1 / (f/E − c/f) and p = τ c/f.
[[nodiscard]] inline double backtrack(const FoundationSum& contact, const Vec6d& step, double pull,
                                      double pull_growth) noexcept {
  const double f = -contact.wrench.dot(step);
  const Vec6d force = symmetric(contact.stiffness + contact.geometric_stiffness) * step;
  const double c = step.dot(force);
  const double in_contact = 1 / (f / contact.energy - c / f), power = in_contact * c / f;
  if (!(f > 0 && in_contact > 0 && power > 0)) return std::numeric_limits<double>::quiet_NaN();
  double back = in_contact;
  for (int i = 0; i < CoupledConstants::kBalanceSteps; ++i)
    back = in_contact * (1 - std::pow(std::max(0.0, pull + back * pull_growth) / f, 1 / power));
  return back;
}

/// Step sizes at which a search ends, of the part of the tool that moves most [m].
struct SearchTolerance {
  double smallest_step;  ///< ends with a step below this
  double motion_step;    ///< ends where the next step would be below this: it follows the device's motion
};

/// Result of a search.
struct SearchResult {
  Posed X;                    ///< pose after the last step
  PoseEvaluation evaluation;  ///< before the last step, so without the effect of `last_step`
  Vec6d last_step = Vec6d::Zero();
  double initial_depth = 0;  ///< penetration depth at the start [m]
  int step_count = 0;
  int evaluation_count = 0;
  bool found_contact = false;  ///< at any evaluated pose
  bool converged = false;      ///< false: the next tick has to carry on
};

/// Pose search: Newton's method with an active set on the energy of a pose. The active set is the set of points in
/// contact, which each evaluation finds anew.
///
/// `evaluate(X)` returns a PoseEvaluation at X, or nothing while the bone's surface there is not available. Its last
/// call is for the pose of `SearchResult::evaluation`. `friction` is the friction of the points found there.
template <class Evaluate, class FrictionModel>
class PoseSearch {
 public:
  PoseSearch(const VirtualCoupling& coupling, const Posed& X_device, const ToolBounds& bounds, Evaluate evaluate,
             const FrictionModel& friction) noexcept
      : coupling_(coupling), X_device_(X_device), bounds_(bounds), evaluate_(evaluate), friction_(friction) {}

  /// Searches from X. `guess` is an expected motion from X, where the model with friction starts.
  [[nodiscard]] SearchResult minimise(const Posed& X, const SearchTolerance& tolerance, Vec6d guess) noexcept {
    SearchResult result;
    result.X = X;
    if (!evaluate_at(result)) return result;
    const FoundationSum& contact = result.evaluation.contact;
    result.initial_depth = contact.depth;
    double previous_size = 0;  // of the last step [m]; 0: no contact there
    for (result.step_count = 1;
         result.step_count <= Constants::kMaxSteps && result.evaluation_count <= Constants::kMaxEvaluations;
         ++result.step_count) {
      // Free here, and all the way to the device.
      if (!contact.has_contact() && contact.clearance.max_step_fraction(motion_between(result.X, X_device_)) >= 1) {
        result.X = X_device_;
        result.converged = true;
        return result;
      }
      const PoseHessian hessian(result.evaluation, coupling_);
      const Vec6d step = friction_.has_friction() && contact.has_contact()
                             ? friction_step(result.evaluation, hessian, guess, previous_size,
                                             std::max(tolerance.smallest_step, tolerance.motion_step))
                             : newton_step(result.evaluation, hessian);
      guess.setZero();
      const Posed X_next = moved(result.X, step);
      const ToolMotion motion = motion_between(result.X, X_next);
      const double size = motion.at(bounds_.arm()) + angular_part(step).norm() * bounds_.radius;
      // If contact began in between, no prediction. A last step is no longer than the contact is deep.
      const double next_size = next_step_size(size, previous_size);
      previous_size = contact.has_contact() ? size : 0;
      if (size <= tolerance.smallest_step ||
          (size <= std::max(contact.depth, result.evaluation.load_depth) && next_size <= tolerance.motion_step)) {
        result.X = X_next;
        result.last_step = step;
        result.converged = true;
        return result;
      }
      if (!line_search(result, step, motion)) return result;
    }
    return result;
  }

 private:
  using Constants = CoupledConstants;

  [[nodiscard]] bool evaluate_at(SearchResult& result) noexcept {
    const std::optional<PoseEvaluation> evaluation = evaluate_(result.X);
    if (!evaluation) return false;
    ++result.evaluation_count;
    result.evaluation = *evaluation;
    result.found_contact = result.found_contact || evaluation->contact.has_contact();
    return true;
  }

  /// Newton step with friction, which is not smooth in the motion: Newton's method on the linear model of contact and
  /// coupling, with `friction_.linearise(motion)` at each iterate.
  ///
  /// It starts at `guess`, and ends when its next step would move no point of the tool farther than `tolerance` [m].
  /// Without a guess its first step is one of the search, whose last one had `last_size` [m]. Returns the step without
  /// friction's model if the motion found is not downhill.
  [[nodiscard]] Vec6d friction_step(const PoseEvaluation& at, const PoseHessian& hessian, const Vec6d& guess,
                                    double last_size, double tolerance) const noexcept {
    Vec6d f = at.contact.wrench + VirtualCoupling::wrench(at.coupling), motion = guess;
    if (!at.solves_rotation) {
      clear_angular(f);
      clear_angular(motion);
    }
    const auto size_of = [this](const Vec6d& v) {
      return linear_part(v).norm() + angular_part(v).norm() * bounds_.arm();
    };
    const bool is_guess = motion.squaredNorm() > 0;
    double previous_size = is_guess ? size_of(motion) : last_size;
    for (int i = 0; i < Constants::kMaxFrictionSteps; ++i) {
      const FrictionSum s = i > 0 || is_guess ? friction_.linearise(motion) : at.friction;
      const Vec6d elastic = hessian.full * motion;
      Vec6d residual = f + s.wrench - elastic;
      Mat6d stiffness = s.stiffness;
      if (!at.solves_rotation) {
        clear_angular(residual);
        clear_angular(stiffness);
      }
      Vec6d step = Vec6d::Zero();
      if (!solve_linear<6>(hessian.full + stiffness, residual, step)) break;
      motion += step;
      const double size = size_of(step);
      if (next_step_size(size, previous_size) <= tolerance) break;
      previous_size = size;
    }
    return motion.dot(at.wrench()) > 0 ? motion : newton_step(at, hessian);
  }

  /// Line search: moves along the step, by which the tool moves by `motion`, until the energy is lower and its slope
  /// small. The trial fractions of the step are extended until a bracket is found. From a trial that went too far the
  /// next one goes back to where a power law of contact balances the coupling; from one too short it halves the
  /// bracket.
  ///
  /// Conservative advancement bounds it: no part of the tool moves farther than its clearance plus a fraction of the
  /// core's radius. Stays at the start if the energy is lower nowhere. Returns false while the bone's surface is not
  /// available.
  [[nodiscard]] bool line_search(SearchResult& result, const Vec6d& step, const ToolMotion& motion) noexcept {
    const double max_fraction =
        result.evaluation.contact.clearance.max_step_fraction(motion, Constants::kCoreFraction * bounds_.core_radius);
    const Posed X = result.X;
    const double initial_energy = result.evaluation.energy(), initial_slope = -result.evaluation.wrench().dot(step);
    const double initial_pull = VirtualCoupling::wrench(result.evaluation.coupling).dot(step);
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double low = 0, low_slope = initial_slope, high = kNone;
    double t = std::min(1.0, max_fraction);
    for (int trial = 0; trial < Constants::kMaxTrials; ++trial) {
      result.X = moved(X, t * step);
      if (!evaluate_at(result)) {
        result.X = X;
        return false;
      }
      const double energy = result.evaluation.energy(), slope = -result.evaluation.wrench().dot(step);
      // Friction has no energy: then the slope alone decides, which is the force along the step.
      const bool is_conservative = !friction_.has_friction();
      const bool is_bracketed = high != kNone;
      const double downhill = is_bracketed ? Constants::kUphillSlope : Constants::kDownhillSlope;
      if ((is_conservative && energy > initial_energy + Constants::kEnergyRounding * std::abs(initial_energy)) ||
          slope > -Constants::kUphillSlope * initial_slope) {
        high = t;
        const double pull = VirtualCoupling::wrench(result.evaluation.coupling).dot(step);
        double back = backtrack(result.evaluation.contact, step, pull, (initial_pull - pull) / t);
        if (!is_finite(back)) back = (high - low) * (slope > 0 ? slope / (slope - low_slope) : 0.5);
        t = high -
            std::clamp(back, Constants::kBracketMargin * (high - low), (1 - Constants::kBracketMargin) * (high - low));
      } else if (slope < downhill * initial_slope && t < max_fraction && (is_conservative || is_bracketed)) {
        low = t;
        low_slope = slope;
        t = is_bracketed ? 0.5 * (low + high) : std::min(Constants::kStepGrowth * t, max_fraction);
      } else {
        return true;
      }
    }
    if (friction_.has_friction() || result.evaluation.energy() <= initial_energy) return true;
    // The farthest trial that went downhill; the start if there is none.
    result.X = low > 0 ? moved(X, low * step) : X;
    return evaluate_at(result);
  }

  const VirtualCoupling& coupling_;
  const Posed& X_device_;
  const ToolBounds& bounds_;
  Evaluate evaluate_;
  const FrictionModel& friction_;
};

}  // namespace trephine
