// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/context.hpp>
#include <trephine/stage/passivity_options.hpp>

#include <algorithm>
#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// A passivity observer and controller after Hannaford and Ryu (2002): measures the energy that the scene delivers to
/// the hand and dissipates the excess by damping.
///
/// *Observer.* The energy delivered in a tick is f₋·(x − x₋) + τ₋·log(R R₋ᵀ). Here f₋, τ₋ is the wrench sent a tick
/// ago, after every stage and limit (see `Stage`: `sent`), and the motion is the tool's relative to the bone. A spring
/// that is held for a tick always delivers some energy: the power `stiffness`·(dt/2 + delay)·|v|², and ½
/// `stiffness`·`quantum` per metre, and the same for rotation. This much is allowed during contact; the rest is the
/// excess W. Set `stiffness` to the stiffness that the device renders stably by its own friction
/// (`DeviceCapabilities::stiffness`). A scene within it passes unchanged, to the bit; a stiffer scene receives the
/// missing damping.
///
/// *Controller.* It injects −s·(`damping` v, `angular_damping` ω), with s in [0, 1] such that one tick at this velocity
/// dissipates W. Known weaknesses of the method, and the remedies here:
/// - No dissipation without motion: the published −W/(dt v²)·v grows without bound as v → 0. Here s is a ratio of two
///   powers and at most 1.
/// - Bursts: the injection is at most `force` and `torque`, and changes by at most `force_rate` and `torque_rate`.
/// - Late action: energy dissipated by friction or earlier contacts is a credit that would hide a generator for long.
///   The credit is at most `reserve` and ends with the contact.
/// - Stored energy: springs store at least |f|²/(2 K), K = `contact_stiffness` being the law's largest tangent
///   stiffness. It counts as delivered at once, not at its release. So a sudden force is detected in the same tick,
///   and a small reserve suffices. With K unknown (0), the reserve must hold the stored energy, F²/(2 K) at the
///   largest force.
/// - Rest: an excess that cannot be dissipated, because the hand does not move, decays with the time constant
///   `memory`.
///
/// The controller damps motion only; it cannot hold a tool that a force pushes through a wall. A vibration stage
/// generates energy on purpose, and is observed and damped even if listed after this stage: leave one of the two out.
/// The servo loop's ramp is not observed, so W is off by its share while it rises. List this stage after all stages
/// that shape the contact force, before rate limit and DeviceLimits. Haptic thread.
class PassivityController {
 public:
  using Options = PassivityOptions;

  /// Throws std::invalid_argument if an option is out of range.
  explicit PassivityController(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void reset() noexcept { *this = PassivityController(options_, Unchecked{}); }

  void begin_tick() noexcept {
    previous_ = next_;  // a tick that ends early sends zero
    next_ = Wrenchd::zero();
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const Twist& v = context.twist_to_bone;
    observe(context, v, wrench);
    slew_to(requested_damping(v, context.dt), context.dt);
    had_contact_ = context.contact.count > 0;
    if (injected_ == Wrenchd::zero()) return;
    wrench += injected_;
  }

  /// Stores the wrench that leaves the scene.
  void sent(const Wrenchd& wrench) noexcept { next_ = wrench; }

  /// Returns the energy delivered to the hand since the start or `reset`, as observed [J]; negative if the hand did
  /// work.
  [[nodiscard]] double given() const noexcept { return delivered_; }
  /// Returns the excess W after its decay [J]; a negative value is credit.
  [[nodiscard]] double excess() const noexcept { return excess_; }
  /// Returns the wrench that the last tick injected, about T's origin, in W axes.
  [[nodiscard]] const Wrenchd& injected() const noexcept { return injected_; }

 private:
  // Numbers that decide.
  static constexpr double kNegligible = 1e-12;     // [N, N·m] smaller injections end the decay, at denormal numbers
  static constexpr double kMaxStoredEnergy = 1e3;  // [J] differences of larger energies would lose all other terms

  struct Unchecked {};
  PassivityController(const Options& options, Unchecked) noexcept : options_(options) {}

  /// Adds the energy of the last interval to the excess. `wrench` is this tick's, before the injection.
  void observe(const TickContext& context, const Twist& v, const Wrenchd& wrench) noexcept {
    const Options& o = options_;
    const double dt = context.dt;
    const double work = dt * (previous_.force.dot(v.linear) + previous_.torque.dot(v.angular));
    const double step = is_finite(work) ? work : 0;
    delivered_ += step;
    double allowed = 0;
    const bool has_contact = context.contact.count > 0;
    if (has_contact || had_contact_) {
      const double hold = dt / 2 + o.delay;
      const double linear = v.linear.norm(), angular = v.angular.norm();
      allowed = dt * (o.stiffness * linear * (hold * linear + o.quantum / 2) +
                      o.angular_stiffness * angular * (hold * angular + o.angular_quantum / 2));
    }
    const double stored = stored_energy(wrench);
    excess_ = std::clamp(excess_ + step - allowed + (stored - stored_), -o.reserve, o.reserve);
    stored_ = stored;
    if (excess_ > 0) excess_ *= std::exp(-dt / o.memory);
    if (!has_contact && excess_ < 0) excess_ = 0;  // credit ends with the contact
  }

  /// Returns a lower bound of the energy stored in springs [J], from the largest tangent stiffness of the law.
  [[nodiscard]] double stored_energy(const Wrenchd& wrench) const noexcept {
    double energy = 0;
    if (options_.contact_stiffness > 0) energy += wrench.force.squaredNorm() / (2 * options_.contact_stiffness);
    if (options_.contact_angular_stiffness > 0)
      energy += wrench.torque.squaredNorm() / (2 * options_.contact_angular_stiffness);
    return std::min(energy, kMaxStoredEnergy);
  }

  /// Returns the damping wrench that dissipates W in one tick, within the limits of damping, force and torque.
  [[nodiscard]] Wrenchd requested_damping(const Twist& v, double dt) const noexcept {
    if (!(excess_ > 0)) return Wrenchd::zero();
    const double max_power =
        options_.damping * v.linear.squaredNorm() + options_.angular_damping * v.angular.squaredNorm();
    const double power = excess_ / dt;
    const double share = power < max_power ? power / max_power : 1;
    return {shortened(-share * options_.damping * v.linear, options_.force),
            shortened(-share * options_.angular_damping * v.angular, options_.torque)};
  }

  /// Changes the injected wrench toward `target` at no more than the given rates.
  void slew_to(const Wrenchd& target, double dt) noexcept {
    const Vec3d force = target.force - injected_.force, torque = target.torque - injected_.torque;
    injected_.force += shortened(force, options_.force_rate * dt);
    injected_.torque += shortened(torque, options_.torque_rate * dt);
    if (target.force.isZero(0) && injected_.force.norm() < kNegligible) injected_.force.setZero();
    if (target.torque.isZero(0) && injected_.torque.norm() < kNegligible) injected_.torque.setZero();
  }

  [[nodiscard]] static Vec3d shortened(const Vec3d& v, double limit) noexcept {
    const double norm = v.norm();
    return norm > limit ? Vec3d(v * (limit / norm)) : v;
  }

  Options options_;
  Wrenchd previous_, next_;  // sent a tick ago and acting since; about to be sent
  Wrenchd injected_;
  double delivered_ = 0;      // [J]
  double excess_ = 0;         // W [J]
  double stored_ = 0;         // stored energy at the last tick [J]
  bool had_contact_ = false;  // at the last tick
};

}  // namespace trephine
