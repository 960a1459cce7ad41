// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/status.hpp>
#include <trephine/core/wrench.hpp>
#include <trephine/guide/guide_options.hpp>
#include <trephine/guide/guide_parts.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

/// Guides: stages that lead the tool along an axis (`AxisGuide`) and stop it at a depth (`DepthStop`), in the bone's
/// frame G. They move with the bone.
///
/// The spring of each guide is the gradient of one potential, in closed form: along closed paths it does no work. Its
/// stiffness holds near the guide, its force and torque are bounded, and neither steps anywhere. A capture radius or
/// angle ends the potential, so that the tool enters and leaves the guide without a gain of energy. Damping opposes the
/// motion relative to the bone; it only dissipates. Only the gain changes in time: it rises from 0 in `ramp` seconds
/// when a guide is enabled or its scene starts, and falls likewise. Enabling a guide with the tool off it gives the
/// spring its energy.
///
/// Each adds to the wrench: list it after stages that scale contact forces (`HuntCrossley`) and before limits. Its
/// stiffness adds to that of contact, guard and other guides in what the device must bear. `budget` is the guide's part
/// of that, and lowers stiffness, force and damping alike where they are more. A potential's level ends only soften it,
/// so the largest tangent stiffness is the spring's own. Haptic thread; options change between ticks or through
/// `Remote`. Cost: a few square roots, and the twists that the scene computes.
namespace trephine::inline TREPHINE_ALIGNED {

/// Holds T's origin on a line of the bone, and T's +z along it: a drill guide. Motion along the line and rotation about
/// it are free.
///
/// With r the distance of T's origin from the line, and c the chord 2 sin(θ/2) of the angle θ between T's +z and the
/// axis, the springs store ½ k r² + ½ k_θ c² until they reach their greatest force and torque. The torque is k_θ sin θ
/// near the axis, and falls to 0 at 180°. The two springs are independent: far off the line the torque acts in full,
/// unless a capture ends it.
///
/// Capture: leaving the guide takes the same energy in each direction, so radius and angle bound the potential's depth
/// together. The tool is free at `capture_radius` on the axis' direction, or at `capture_angle` on the line, or nearer.
/// Springs act in full up to a quarter of the depth. On the way out the force falls by at most 8/3 k a metre.
///
/// A scene with `ForceOnly` drops the torque: set `angular_stiffness` to 0 then, or rotation changes the force.
class AxisGuide {
 public:
  using Options = AxisGuideOptions;

  /// Throws std::invalid_argument if an option is out of range.
  explicit AxisGuide(const Options& options) : gain_(options.within_budget()) { options.validate(); }

  /// Returns the latest options, lowered to their budget: `stiffness` and `angular_stiffness` are the largest that the
  /// tool feels. A new law acts once the gain of the old one has fallen to 0.
  [[nodiscard]] const Options& options() const noexcept { return gain_.wanted(); }
  /// Replaces the options, which `validate` must accept, without a step of the wrench; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { gain_.adopt(options.within_budget()); }
  void reset() noexcept { gain_.restart(); }

  /// Returns the present gain, in [0, 1].
  [[nodiscard]] double gain() const noexcept { return gain_.gain(); }
  /// Returns the spring's energy [J] at a gain of 1: 0 on the guide.
  [[nodiscard]] double energy(const Posed& X_GT) const noexcept { return evaluate(Posed::Identity(), X_GT).energy; }
  /// Returns the spring's wrench on the tool about T's origin, in G axes, at a gain of 1.
  [[nodiscard]] Wrenchd spring(const Posed& X_GT) const noexcept { return evaluate(Posed::Identity(), X_GT).spring; }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (context.status >= Status::kJump) gain_.restart();
    const double gain = gain_.advance(context.dt);
    if (gain == 0) return;
    const Options& o = gain_.active();
    const Evaluation now = evaluate(context.X_WG, context.input.X_WT);
    const Vec3d& v = context.twist_to_bone.linear;
    const Vec3d& w = context.twist_to_bone.angular;
    const Vec3d across = v - now.axis.dot(v) * now.axis;
    const Vec3d tilting = w - now.shaft.dot(w) * now.shaft;
    const Vec3d force = now.spring.force - now.share * o.damping * across;
    const Vec3d torque = now.spring.torque - now.share * o.angular_damping * tilting;
    wrench.force += gain * detail::shortened(force, o.force);
    wrench.torque += gain * detail::shortened(torque, o.torque);
  }

 private:
  struct Evaluation {
    double energy;  // [J]
    Wrenchd spring;
    double share;  // of the guide, 0 beyond its capture
    Vec3d axis;    // unit
    Vec3d shaft;   // T's +z, unit
  };

  /// Evaluates the potential and its gradient in the axes that both poses map to.
  [[nodiscard]] Evaluation evaluate(const Posed& X_WG, const Posed& X_WT) const noexcept {
    const Options& o = gain_.active();
    const Vec3d axis = (X_WG.linear() * o.axis_G).normalized();
    const Vec3d shaft = z_axis(X_WT).normalized();
    const Vec3d from_point = X_WT.translation() - X_WG * o.point_G;
    const Vec3d offset = from_point - axis.dot(from_point) * axis;
    const double distance = offset.norm();
    const double chord = (shaft - axis).norm();
    const detail::BoundedSpring lateral{o.stiffness, o.force};
    const detail::BoundedSpring angular{o.angular_stiffness, o.torque};
    detail::CaptureWell well;
    if (is_finite(o.capture_radius)) well.depth = lateral.energy(o.capture_radius);
    if (is_finite(o.capture_angle)) {
      const double widest = 2 * std::sin(0.5 * std::min(o.capture_angle, std::numbers::pi));
      well.depth = std::min(well.depth, angular.energy(widest));
    }
    const auto [energy, share] = well.at(lateral.energy(distance) + angular.energy(chord));
    const Vec3d force = -share * lateral.secant(distance) * offset;
    const Vec3d torque = share * angular.secant(chord) * shaft.cross(axis);
    return {energy, {force, torque}, share, axis, shaft};
  }

  detail::GuideGain<Options> gain_;
};

/// Stops the tool at a plane across an axis: beyond it a spring pushes back along the axis. It only pushes, never
/// pulls.
///
/// The depth is `reach` − (p_GT − point_G)·axis, with p_GT the position of T's origin. `reach` is how far the tool
/// extends beyond its origin: the tip's radius for a burr. The force acts at T's origin, without torque.
///
/// Without a capture radius the stop is the whole plane, and its force is `force` however deep the tool is. With one,
/// the stop is a round peg with rounded edges, whose side pushes out. A force that is bounded and ends at a radius
/// cannot hold a tool forever: from depths of half the capture radius on, the push along the axis weakens, and a tool
/// deeper than the radius is pushed aside. Choose a radius well above force/stiffness. The force changes by at most 6 k
/// a metre.
class DepthStop {
 public:
  using Options = DepthStopOptions;

  /// Throws std::invalid_argument if an option is out of range.
  explicit DepthStop(const Options& options) : gain_(options.within_budget()) { options.validate(); }

  /// Returns the latest options, lowered to their budget: `stiffness` is the largest that the tool feels. A new law
  /// acts once the gain of the old one has fallen to 0.
  [[nodiscard]] const Options& options() const noexcept { return gain_.wanted(); }
  /// Replaces the options, which `validate` must accept, without a step of the wrench; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { gain_.adopt(options.within_budget()); }
  void reset() noexcept { gain_.restart(); }

  /// Returns the present gain, in [0, 1].
  [[nodiscard]] double gain() const noexcept { return gain_.gain(); }
  /// Returns the spring's energy [J] at a gain of 1: 0 before the stop.
  [[nodiscard]] double energy(const Posed& X_GT) const noexcept { return evaluate(Posed::Identity(), X_GT).energy; }
  /// Returns the spring's wrench on the tool about T's origin, in G axes, at a gain of 1.
  [[nodiscard]] Wrenchd spring(const Posed& X_GT) const noexcept {
    const Evaluation now = evaluate(Posed::Identity(), X_GT);
    return {now.push * now.direction, Vec3d::Zero()};
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (context.status >= Status::kJump) gain_.restart();
    const double gain = gain_.advance(context.dt);
    if (gain == 0) return;
    const Options& o = gain_.active();
    const Evaluation now = evaluate(context.X_WG, context.input.X_WT);
    if (!(now.push > 0)) return;
    // Damping grows with the push, so that it does not start with a step.
    const double rate = now.direction.dot(context.twist_to_bone.linear);
    const double damped = now.push - o.damping * (now.push / o.force) * rate;
    wrench.force += gain * std::clamp(damped, 0.0, o.force) * now.direction;
  }

 private:
  /// Parts of the capture radius: over which the peg's top turns into its side, and within which its side is blunt.
  static constexpr double kBlend = 0.25;
  static constexpr double kBlunt = 0.25;

  struct Evaluation {
    double energy;    // [J]
    double push;      // [N], >= 0
    Vec3d direction;  // no longer than 1
  };

  /// Evaluates the potential and its gradient in the axes that both poses map to.
  [[nodiscard]] Evaluation evaluate(const Posed& X_WG, const Posed& X_WT) const noexcept {
    const Options& o = gain_.active();
    const Vec3d axis = (X_WG.linear() * o.axis_G).normalized();
    const Vec3d from_point = X_WT.translation() - X_WG * o.point_G;
    const double along = axis.dot(from_point);
    double depth = o.reach - along;
    Vec3d direction = axis;
    if (is_finite(o.capture_radius)) {
      const Vec3d offset = from_point - along * axis;
      const double blunt = kBlunt * o.capture_radius;
      const double blunted = std::hypot(offset.norm(), blunt);
      const double to_side = std::hypot(o.capture_radius, blunt) - blunted;
      const auto nearer = detail::SmoothMinimum::of(depth, to_side, kBlend * o.capture_radius);
      depth = nearer.value;
      direction = nearer.share * axis + ((1 - nearer.share) / blunted) * offset;
    }
    if (!(depth > 0)) return {0, 0, direction};
    const detail::BoundedSpring spring{o.stiffness, o.force};
    return {spring.energy(depth), spring.pull(depth), direction};
  }

  detail::GuideGain<Options> gain_;
};

}  // namespace trephine
