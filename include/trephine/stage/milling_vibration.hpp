// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <cmath>
#include <numbers>

namespace trephine::inline TREPHINE_ALIGNED {

/// Vibration of a cutting burr: adds a sine force A sin(2π f t) while the spindle turns in contact, zero otherwise.
/// A = per_force · |f_contact| + per_removal · (removed volume / dt), at most `amplitude_limit`.
///
/// It is an effect, not a model. Dental and ear spindles turn at 333–1333 Hz (20–80 krpm), and their teeth pass at
/// several times that. A force held for a tick at 1 kHz aliases such frequencies to any frequency below 500 Hz, even to
/// 0 Hz, which is a steady push. So the frequency must be low enough for the loop, at most 300 Hz. Fingers are most
/// sensitive there too.
///
/// Direction: perpendicular to the contact force, because a burr's teeth pull along the surface. The mean normal force,
/// which drives carving and penetration, is unchanged; a vibration along the normal would make the tool bounce and dig
/// in. The direction starts along (shaft axis × contact force), the pull of the teeth. Each tick projects it onto the
/// plane normal to the present force, because a direction computed anew would flip somewhere. The vibration acts at T's
/// origin: no torque.
///
/// The phase grows by f·dt a tick and starts at zero with the spindle, so the same time gives the same force at any
/// tick rate. A tick of dt >= 1/(2f), a rate of 2f or less, has no vibration, because it would alias. Just above 2f
/// the sine is coarse (its samples beat); at 5f and more it is smooth.
///
/// The vibration generates energy, up to A·|v|: leave it out of passivity measurements. The stage takes its input for
/// the contact force, so list it before `Damping`. Haptic thread.
class MillingVibration {
 public:
  static constexpr bool kUsesTwist = false;
  /// [Hz] largest frequency: a loop of 1 kHz then renders 3.3 samples a period.
  static constexpr double kMaxFrequency = 300;

  struct Options {
    double frequency = 180;        ///< f [Hz], in (0, 300]
    double per_force = 0.08;       ///< amplitude by contact force [N/N], >= 0
    double per_removal = 0;        ///< amplitude by removal rate [N/(mm³/s)], >= 0
    double amplitude_limit = 0.5;  ///< largest A [N], >= 0

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      const auto at_least_zero = [](double v) { return v >= 0 && is_finite(v); };
      if (!(frequency > 0) || !(frequency <= kMaxFrequency))
        refuse("MillingVibration", "frequency must be in (0, 300] Hz", frequency);
      if (!at_least_zero(per_force)) refuse("MillingVibration", "per_force must be finite and >= 0 N/N", per_force);
      if (!at_least_zero(per_removal))
        refuse("MillingVibration", "per_removal must be finite and >= 0 N·s/mm³", per_removal);
      if (!at_least_zero(amplitude_limit))
        refuse("MillingVibration", "amplitude_limit must be finite and >= 0 N", amplitude_limit);
    }
  };

  /// Throws std::invalid_argument if an option is out of range.
  explicit MillingVibration(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept, without a jump of the phase; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void reset() noexcept {
    phase_ = 0;
    direction_.setZero();
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (!context.input.spindle_on) return reset();
    const double advance = options_.frequency * context.dt;
    phase_ += advance;
    phase_ -= std::floor(phase_);
    const double force = wrench.force.norm();
    if (context.contact.count == 0 || !(force > 0) || !is_finite(force)) {
      direction_.setZero();
      return;
    }
    update_direction(wrench.force / force, context.input.X_WT.linear());
    if (!(advance < 0.5)) return;
    const double requested = options_.per_force * force + options_.per_removal * (context.removed_mm3 / context.dt);
    const double amplitude = requested < options_.amplitude_limit ? requested : options_.amplitude_limit;
    wrench.force += (amplitude * std::sin(2 * std::numbers::pi * phase_)) * direction_;
  }

 private:
  /// Sine of about 6° between a vector and the contact normal. A shorter projection gives no reliable direction.
  static constexpr double kMinProjection = 0.1;

  /// Projects the last tick's direction onto the plane with normal n. At the start of contact the direction is the pull
  /// of the teeth, or the projected x axis of the tool if the shaft is parallel to the force.
  void update_direction(const Vec3d& n, const Mat3d& R_WT) noexcept {
    Vec3d d = direction_ - n.dot(direction_) * n;
    if (!(d.norm() > kMinProjection)) d = R_WT.col(2).cross(n);
    if (!(d.norm() > kMinProjection)) d = R_WT.col(0) - n.dot(R_WT.col(0)) * n;
    direction_ = d.normalized();
  }

  Options options_;
  double phase_ = 0;                 // [periods], in [0, 1)
  Vec3d direction_ = Vec3d::Zero();  // unit, in W; zero out of contact
};

}  // namespace trephine
