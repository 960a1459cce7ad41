// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>
#include <cmath>

namespace trephine {

/// Watches the energy that the scene gives to the hand and takes the surplus out by damping (a passivity observer and
/// controller, after Hannaford and Ryu 2002).
///
/// *Observer.* A tick gives f₋·(x − x₋) + τ₋·log(R R₋ᵀ), where f₋, τ₋ is the wrench that went out a tick ago, after
/// every stage and limit (see `Stage`: `sent`), and the motion is the tool's against the bone. A held spring always
/// gives some of that, `stiffness`·(dt/2 + delay)·|v|² of power and ½ `stiffness`·`quantum` a metre, and the same for
/// rotation. While the tool touches so much is allowed; what goes beyond is the excess W. State here the stiffness that
/// the device bears by its own friction (`DeviceCapabilities::stiffness`): a scene within it is never touched, to the
/// bit; one above it gets the damping that the device lacks.
///
/// *Controller.* −s·(`damping` v, `angular_damping` ω) with s in [0, 1] such that a tick at this velocity would take
/// out W. The known faults of the method and what is done here:
/// - No motion, no dissipation: the published −W/(dt v²)·v grows without bound as v → 0. Here s is a ratio of two
/// powers
///   and at most 1.
/// - Bursts: the injection is at most `force` and `torque`, and changes by at most `force_rate` and `torque_rate`.
/// - Late action: energy that friction or earlier contacts took from the hand would be a credit that hides a generator
///   for long. The credit is at most `reserve` and ends with the contact. What lies in the springs, at least |f|²/(2 K)
///   where `contact_stiffness` K is the law's largest tangent stiffness, is counted as given at once and not when the
///   hand gets it back: a force that jumps up from nothing is seen in the same tick, and the reserve can be small.
///   Where K is not known (0), the reserve must hold what the springs store, F²/(2 K) at the most force.
/// - What could not be taken out, because the hand stands still, is forgotten within about `memory`.
///
/// It damps only where there is motion; it cannot hold what a force pushes through a wall. A vibration stage makes
/// energy on purpose: list it after this one and it is observed, and damped, all the same; leave one of the two out.
/// The servo loop's ramp is not seen here: while it rises W is off by as much.
/// List it after all stages that shape the contact force, before rate limit and DeviceLimits. Haptic thread.
class PassivityController {
 public:
  struct Options {
    double stiffness = 800;                ///< what a device bears [N/m], >= 0
    double angular_stiffness = 0.3;        ///< the same for rotation [N·m/rad], >= 0
    double delay = 0;                      ///< of the loop beside the hold [s], >= 0
    double quantum = 0;                    ///< of position readings [m], >= 0
    double angular_quantum = 0;            ///< [rad], >= 0
    double contact_stiffness = 0;          ///< largest tangent stiffness of the law [N/m]; 0: stored energy unknown
    double contact_angular_stiffness = 0;  ///< [N·m/rad]; 0: torque stores nothing
    double damping = 5;                    ///< most that is injected [N·s/m], >= 0; below a tenth of 2 m/dt
    double angular_damping = 5e-3;         ///< [N·m·s/rad], >= 0
    double force = 1.5;                    ///< longest injected force [N], >= 0
    double torque = 0.03;                  ///< [N·m], >= 0
    double force_rate = 300;               ///< fastest change of the injected force [N/s], > 0
    double torque_rate = 6;                ///< [N·m/s], > 0
    double reserve = 10e-3;                ///< largest credit, and largest debt [J], >= 0
    double memory = 0.2;                   ///< time constant in which a debt is forgotten [s], > 0

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      const auto at_least_zero = [](const char* rule, double v) {
        if (!(v >= 0) || !std::isfinite(v)) refuse("PassivityController", rule, v);
      };
      const auto above_zero = [](const char* rule, double v) {
        if (!(v > 0) || !std::isfinite(v)) refuse("PassivityController", rule, v);
      };
      at_least_zero("stiffness must be finite and >= 0 N/m", stiffness);
      at_least_zero("angular_stiffness must be finite and >= 0 N·m/rad", angular_stiffness);
      at_least_zero("delay must be finite and >= 0 s", delay);
      at_least_zero("quantum must be finite and >= 0 m", quantum);
      at_least_zero("angular_quantum must be finite and >= 0 rad", angular_quantum);
      at_least_zero("contact_stiffness must be finite and >= 0 N/m", contact_stiffness);
      at_least_zero("contact_angular_stiffness must be finite and >= 0 N·m/rad", contact_angular_stiffness);
      at_least_zero("damping must be finite and >= 0 N·s/m", damping);
      at_least_zero("angular_damping must be finite and >= 0 N·m·s/rad", angular_damping);
      at_least_zero("force must be finite and >= 0 N", force);
      at_least_zero("torque must be finite and >= 0 N·m", torque);
      above_zero("force_rate must be finite and > 0 N/s", force_rate);
      above_zero("torque_rate must be finite and > 0 N·m/s", torque_rate);
      at_least_zero("reserve must be finite and >= 0 J", reserve);
      above_zero("memory must be finite and > 0 s", memory);
    }
  };

  /// Throws std::invalid_argument if an option is out of range.
  explicit PassivityController(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void reset() noexcept { *this = PassivityController(options_, Unchecked{}); }

  void begin_tick() noexcept {
    held_ = next_;  // a tick that ends early sends zero
    next_ = Wrenchd::zero();
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const Twist& v = context.twist_to_bone;
    observe(context, v, wrench);
    follow(wanted(v, context.dt), context.dt);
    touched_ = context.contact.count > 0;
    if (injected_ == Wrenchd::zero()) return;
    wrench += injected_;
  }

  /// The wrench as it leaves the scene.
  void sent(const Wrenchd& wrench) noexcept { next_ = wrench; }

  /// Energy given to the hand since the start or `reset`, as observed [J]; below zero: taken from it.
  [[nodiscard]] double given() const noexcept { return given_; }
  /// W: what is beyond the allowance, less what is forgotten [J].
  [[nodiscard]] double excess() const noexcept { return excess_; }
  /// What the last tick injected.
  [[nodiscard]] const Wrenchd& injected() const noexcept { return injected_; }

 private:
  struct Unchecked {};
  PassivityController(const Options& options, Unchecked) noexcept : options_(options) {}

  void observe(const TickContext& context, const Twist& v, const Wrenchd& wrench) noexcept {
    const Options& o = options_;
    const double dt = context.dt;
    const double work = dt * (held_.force.dot(v.linear) + held_.torque.dot(v.angular));
    const double step = std::isfinite(work) ? work : 0;
    given_ += step;
    double allowed = 0;
    const bool touches = context.contact.count > 0;
    if (touches || touched_) {
      const double hold = dt / 2 + o.delay;
      const double linear = v.linear.norm(), angular = v.angular.norm();
      allowed = dt * (o.stiffness * linear * (hold * linear + o.quantum / 2) +
                      o.angular_stiffness * angular * (hold * angular + o.angular_quantum / 2));
    }
    const double stored = stored_in(wrench);
    excess_ = std::clamp(excess_ + step - allowed + (stored - stored_), -o.reserve, o.reserve);
    stored_ = stored;
    if (excess_ > 0) excess_ *= std::exp(-dt / o.memory);
    if (!touches && excess_ < 0) excess_ = 0;  // credit ends with the contact
  }

  /// At least so much energy lies in springs whose tangent stiffness is never above the one stated.
  [[nodiscard]] double stored_in(const Wrenchd& wrench) const noexcept {
    double energy = 0;
    if (options_.contact_stiffness > 0) energy += wrench.force.squaredNorm() / (2 * options_.contact_stiffness);
    if (options_.contact_angular_stiffness > 0)
      energy += wrench.torque.squaredNorm() / (2 * options_.contact_angular_stiffness);
    return std::min(energy, kMostStored);
  }

  [[nodiscard]] Wrenchd wanted(const Twist& v, double dt) const noexcept {
    if (!(excess_ > 0)) return Wrenchd::zero();
    const double most = options_.damping * v.linear.squaredNorm() + options_.angular_damping * v.angular.squaredNorm();
    const double need = excess_ / dt;
    const double share = need < most ? need / most : 1;
    return {shortened(-share * options_.damping * v.linear, options_.force),
            shortened(-share * options_.angular_damping * v.angular, options_.torque)};
  }

  void follow(const Wrenchd& target, double dt) noexcept {
    const Vec3d force = target.force - injected_.force, torque = target.torque - injected_.torque;
    injected_.force += shortened(force, options_.force_rate * dt);
    injected_.torque += shortened(torque, options_.torque_rate * dt);
    if (target.force.isZero(0) && injected_.force.norm() < kGone) injected_.force.setZero();
    if (target.torque.isZero(0) && injected_.torque.norm() < kGone) injected_.torque.setZero();
  }

  [[nodiscard]] static Vec3d shortened(const Vec3d& v, double limit) noexcept {
    const double norm = v.norm();
    return norm > limit ? Vec3d(v * (limit / norm)) : v;
  }

  static constexpr double kGone = 1e-12;      // [N, N·m]
  static constexpr double kMostStored = 1e3;  // [J]; differences of more would swallow the rest

  Options options_;
  Wrenchd held_, next_;  // sent a tick ago and acting since; about to be sent
  Wrenchd injected_;
  double given_ = 0;
  double excess_ = 0;
  double stored_ = 0;  // at the last tick
  bool touched_ = false;
};

}  // namespace trephine
