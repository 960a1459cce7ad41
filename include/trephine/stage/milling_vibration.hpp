// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <cmath>
#include <numbers>

namespace trephine {

/// The tremble of a burr that bites: a sine force A sin(2π f t) added while the spindle turns and the tool touches,
/// zero otherwise. A = per_force · |f_contact| + per_removal · (removed volume / dt), at most `amplitude_limit`.
///
/// It is an effect, not a model. Dental and ear spindles turn at 333–1333 Hz (20–80 krpm), with several times that for
/// their teeth; held for a tick at 1 kHz those frequencies fold down to anything below 500 Hz, 0 Hz included, which is
/// a push. So the frequency is one the loop can render, at most 300 Hz, where fingers are most sensitive too.
///
/// Direction: perpendicular to the contact force. A burr's teeth pull along the surface, so that is where it shakes;
/// and the mean press on the bone, which carving and the hand's penetration follow, stays as it is: a shake along the
/// normal would make the tool bounce off and dig in. It starts along (shaft axis × contact force), where the teeth
/// pull, and is then carried along with the force as that turns, because any direction computed anew each tick would
/// flip somewhere. The vibration acts at T's origin: no torque.
///
/// The phase grows by f·dt a tick and starts at zero with the spindle, so the same seconds give the same force at any
/// tick rate. A tick of dt >= 1/(2f), that is a rate of 2f or less, gets no vibration: it could not be told from
/// another frequency. Just above 2f the sine is coarse (its samples beat); 5f and more is smooth.
///
/// A source of energy, up to A·|v|: leave it out where passivity is judged. The wrench it is given is taken for the
/// contact force, so list it before `Damping`. Haptic thread.
class MillingVibration {
 public:
  static constexpr bool kUsesTwist = false;
  static constexpr double kHighestFrequency = 300;  ///< [Hz]

  struct Options {
    double frequency = 180;        ///< f [Hz], in (0, 300]
    double per_force = 0.08;       ///< amplitude by contact force [N/N], >= 0
    double per_removal = 0;        ///< amplitude by removal rate [N/(mm³/s)], >= 0
    double amplitude_limit = 0.5;  ///< largest A [N], >= 0

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      const auto at_least_zero = [](double v) { return v >= 0 && std::isfinite(v); };
      if (!(frequency > 0) || !(frequency <= kHighestFrequency))
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
    const double press = wrench.force.norm();
    if (context.contact.count == 0 || !(press > 0) || !std::isfinite(press)) {
      direction_.setZero();
      return;
    }
    turn_direction(wrench.force / press, context.input.X_WT.linear());
    if (!(advance < 0.5)) return;
    const double wanted = options_.per_force * press + options_.per_removal * (context.removed_mm3 / context.dt);
    const double amplitude = wanted < options_.amplitude_limit ? wanted : options_.amplitude_limit;
    wrench.force += (amplitude * std::sin(2 * std::numbers::pi * phase_)) * direction_;
  }

 private:
  /// Takes the normal's part out of the direction of the last tick; at a start the teeth's pull, and the tool's x axis
  /// where the shaft stands along the force and the teeth pull every way.
  void turn_direction(const Vec3d& n, const Mat3d& R_WT) noexcept {
    constexpr double kEnough = 0.1;  // shorter than this a projection says little about direction
    Vec3d d = direction_ - n.dot(direction_) * n;
    if (!(d.norm() > kEnough)) d = R_WT.col(2).cross(n);
    if (!(d.norm() > kEnough)) d = R_WT.col(0) - n.dot(R_WT.col(0)) * n;
    direction_ = d.normalized();
  }

  Options options_;
  double phase_ = 0;                 // periods, [0, 1)
  Vec3d direction_ = Vec3d::Zero();  // unit, in W; zero out of contact
};

}  // namespace trephine
