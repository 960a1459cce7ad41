// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/number.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/status.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/core/wrench.hpp>
#include <trephine/guide/guide_options.hpp>
#include <trephine/guide/guide_parts.hpp>
#include <trephine/render/stiffness_budget.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/smooth_distance.hpp>
#include <trephine/structure/structure_field.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// A guide that keeps the tip's ball in a structure: a planned cavity, an implant's bed. It only pushes back, never
/// onward, and leaves the shaft free.
/// \code
/// KeepIn keep{field, cavity, X_GS, {.radius = burr.tip_radius, .capture = 3_mm}};
/// HapticScene{bone, 300, renderer, Cutting{...}, keep, limits};
/// \endcode
/// u = d + radius + margin is how far the ball is beyond the border, with d the structure's distance at T's origin,
/// smoothed as a guard's. The push is the gradient of one potential of u: it starts at 0, grows with the stiffness to
/// the greatest force, and ends at `capture`, so that the tool enters and leaves without a step. Along closed paths it
/// does no work. Its force acts at T's origin, without torque. In a place narrower than the ball it pushes to the
/// middle.
///
/// No device stops a hand: `StructureVeto::Mode::kKeepIn` keeps the cut within the cavity. List the guide after stages
/// that scale contact forces and before limits. Haptic thread; options change between ticks or through `Remote`. Copies
/// share the smooth distance.
class KeepIn {
 public:
  struct Options {
    double radius = 0;       ///< of the tip's ball [m], >= 0
    double margin = 0;       ///< between ball and border [m], >= 0
    double stiffness = 400;  ///< k [N/m], >= 0
    double force = 2;        ///< greatest force of spring and damping together [N], >= 0
    double damping = 0;      ///< along the force [N·s/m], >= 0; in full from force/stiffness beyond the border on
    double capture = 3e-3;   ///< distance of T's origin from the structure where the push ends [m], > 0
    bool enabled = true;
    double ramp = 0.5;  ///< time of the gain from 0 to 1 [s], >= 0.05
    /// Of this guide; stiffness, force and damping are lowered alike where it is more. The others' stiffness adds to
    /// it.
    std::optional<StiffnessBudget> budget{};

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      detail::check_at_least_zero(kType, "radius", "m", radius);
      refuse_beyond(kType, "radius", kLongestShaft, radius);
      detail::check_at_least_zero(kType, "margin", "m", margin);
      refuse_beyond(kType, "margin", kLongestShaft, margin);
      detail::check_at_least_zero(kType, "stiffness", "N/m", stiffness);
      detail::check_at_least_zero(kType, "force", "N", force);
      detail::check_at_least_zero(kType, "damping", "N·s/m", damping);
      detail::check_above_zero(kType, "capture", "m", capture);
      detail::check_at_least_zero(kType, "capture", "m", capture);
      detail::check_ramp(kType, ramp);
      if (budget) budget->validate();
    }
    /// Returns true if the other options give the same force at a gain of 1.
    [[nodiscard]] bool has_law_of(const Options& o) const noexcept {
      return radius == o.radius && margin == o.margin && stiffness == o.stiffness && force == o.force &&
             damping == o.damping && capture == o.capture;
    }
    static constexpr const char* kType = "KeepIn";
  };

  /// Smooths distances over `smoothing` [m], as a guard's: the push turns over this length where two parts of the
  /// border are equally near. X_GS is the pose of the structures' frame in the bone's. Throws std::invalid_argument for
  /// options out of range, a number that is none of the field's structures, a pose that is not rigid, or a field whose
  /// bands do not reach `required_reach`.
  KeepIn(const StructureField& field, int structure, const Posed& X_GS, const Options& options,
         double smoothing = 0.6e-3)
      : gain_(options), made_(options), X_SG_(inverse(X_GS)), reach_(field.reach()), smoothing_(smoothing) {
    options.validate();
    if (structure < 0 || structure >= field.structures())
      refuse(Options::kType, "structure must be a number of the field's", structure);
    if (!(smoothing >= 0.05e-3) || !(smoothing <= 0.01))
      refuse(Options::kType, "smoothing must be 0.00005 to 0.01 m", smoothing);
    if (!is_usable_pose(X_GS)) refuse(Options::kType, "X_GS must be rigid", "not so");
    check_reach(options);
    auto distance = std::make_shared<SmoothDistance>(field, structure, smoothing, reach_);
    find_stiffness(*distance);
    distance->release_knots();
    distance_ = std::move(distance);
    gain_ = detail::GuideGain<Options>(within_budget(options));
  }

  /// Returns the reach that a field's bands need [m].
  [[nodiscard]] static double required_reach(const Options& options, double smoothing = 0.6e-3) noexcept {
    return std::max(options.capture, options.radius + options.margin) + 2.6 * smoothing;
  }

  /// Returns the latest options, lowered to their budget; a new law acts once the gain of the old one has fallen to 0.
  [[nodiscard]] const Options& options() const noexcept { return gain_.wanted(); }
  /// Replaces the options, which `validate` must accept, without a step of the force; between ticks, haptic thread. A
  /// capture, radius or margin beyond the field's bands is shortened to them.
  void adopt(const Options& options) noexcept {
    Options within = options;
    const double most = reach_ - 2.6 * smoothing_;
    within.capture = std::min(within.capture, most);
    within.radius = std::min(within.radius, most);
    within.margin = std::min(within.margin, most - within.radius);
    gain_.adopt(within_budget(within));
  }
  /// Returns the largest stiffness of the push under the latest options [N/m], found at the knots and between them. In
  /// places narrower than the ball it exceeds `Options::stiffness`, as the push turns over within a smoothing. Options
  /// that differ from those at construction have a bound of it.
  [[nodiscard]] double stiffness() const noexcept { return stiffness_of(options()); }
  void reset() noexcept { gain_.restart(); }

  /// Returns the present gain, in [0, 1].
  [[nodiscard]] double gain() const noexcept { return gain_.gain(); }
  /// Returns the spring's energy [J] at a gain of 1, for T's origin at p_GT: 0 inside.
  [[nodiscard]] double energy(const Vec3d& p_GT) const noexcept { return evaluate(p_GT).energy; }
  /// Returns the spring's force on the tool [N] at T's origin, in G axes, at a gain of 1.
  [[nodiscard]] Vec3d spring(const Vec3d& p_GT) const noexcept {
    const Evaluation now = evaluate(p_GT);
    return now.push * now.inward;
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (context.status >= Status::kJump) gain_.restart();
    const double gain = gain_.advance(context.dt);
    if (gain == 0) return;
    const Options& o = gain_.active();
    const Evaluation now = evaluate(relative_pose(context.X_WG, context.input.X_WT).translation());
    if (!(now.push > 0)) return;
    const Vec3d inward = context.X_WG.linear() * now.inward;
    // Damping grows with the push, so that it does not start with a step.
    const double damped = now.push - o.damping * (now.push / o.force) * inward.dot(context.twist_to_bone.linear);
    wrench.force += gain * std::clamp(damped, 0.0, o.force) * inward;
  }

 private:
  struct Evaluation {
    double energy = 0;             // [J]
    double push = 0;               // [N], >= 0
    Vec3d inward = Vec3d::Zero();  // no longer than 1, in G
  };

  [[nodiscard]] Evaluation evaluate(const Vec3d& p_GT) const noexcept {
    const Options& o = gain_.active();
    const detail::BoundedSpring spring{o.stiffness, o.force};
    const detail::CaptureWell well{spring.energy(std::max(o.capture + o.radius + o.margin, 0.0))};
    Vec3d outward_S;
    const std::optional<double> d = distance_->at(X_SG_ * p_GT, outward_S);
    if (!d || *d >= o.capture) return {.energy = well.at(well.depth).energy};
    const double beyond = *d + o.radius + o.margin;
    if (!(beyond > 0)) return {};
    const auto [energy, share] = well.at(spring.energy(beyond));
    return {energy, share * spring.pull(beyond), -(X_SG_.linear().transpose() * outward_S)};
  }

  /// Finds the largest stiffness under the options at construction, and the largest curvature of the distance. The end
  /// of the potential only softens it.
  void find_stiffness(const SmoothDistance& distance) {
    const auto largest = [](const Mat3d& K) {
      return Eigen::SelfAdjointEigenSolver<Mat3d>(K, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
    };
    for (const Vec3d& knot : distance.knots())
      for (const double shift : {0.0, 0.5 * smoothing_}) {
        const Vec3d p = knot + Vec3d::Constant(shift);
        Vec3d g;
        const std::optional<double> d = distance.at(p, g);
        if (!d || *d >= made_.capture) continue;
        const Mat3d second = distance.curvature(p, g);
        curvature_ = std::max(curvature_, largest(second));
        const double u = *d + made_.radius + made_.margin;
        if (!(u > 0)) continue;
        Mat3d K = std::min(made_.stiffness * u, made_.force) * second;
        if (made_.stiffness * u <= made_.force) K += made_.stiffness * g * g.transpose();
        stiffest_ = std::max(stiffest_, largest(K));
      }
  }
  /// A stiffness times g gᵀ and a force times the second derivative: at most each times its greatest. With the ball and
  /// margin at construction, or less, no more than that law's times what grew more.
  [[nodiscard]] double stiffness_of(const Options& o) const noexcept {
    double bound = o.stiffness + o.force * curvature_;
    if (made_.stiffness > 0 && made_.force > 0 && o.radius + o.margin <= made_.radius + made_.margin &&
        o.capture <= made_.capture)
      bound = std::min(bound, stiffest_ * std::max(o.stiffness / made_.stiffness, o.force / made_.force));
    return bound;
  }
  [[nodiscard]] Options within_budget(Options o) const noexcept {
    const double share = o.budget ? detail::share_within(o.budget->linear, stiffness_of(o)) : 1.0;
    o.stiffness *= share, o.force *= share, o.damping *= share;
    return o;
  }

  void check_reach(const Options& options) const {
    const double reach = required_reach(options, smoothing_);
    if (reach_ < reach)
      refuse(Options::kType,
             "the field's bands must reach the capture, or radius + margin, and 2.6 smoothing = " +
                 number_text(1e3 * reach) + " mm",
             1e3 * reach_);
  }

  detail::GuideGain<Options> gain_;
  Options made_;  // at construction
  double stiffest_ = 0, curvature_ = 0;
  Posed X_SG_;
  double reach_, smoothing_;
  std::shared_ptr<const SmoothDistance> distance_;
};

}  // namespace trephine
