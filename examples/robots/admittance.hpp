// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/wrench.hpp>
#include <trephine/stage/motion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace robots {

using namespace trephine;

/// Options of an `Admittance`.
struct AdmittanceOptions {
  double gain = 5e-3;            ///< G: speed for a force [m/s/N], > 0
  double turn_gain = 2;          ///< of rotation [rad/s/(N·m)], > 0
  double cutoff = 10;            ///< of the filter of force and torque [Hz], > 0
  double dead_band = 0.2;        ///< b: the tool rests below this force [N], >= 0
  double turn_dead_band = 0.01;  ///< the same for torque [N·m], >= 0
  double speed = 0.03;           ///< largest of T [m/s], > 0
  double turn_speed = 1;         ///< largest [rad/s], > 0
  double ramp = 0.1;             ///< in which the gain rises after a restart [s], > 0

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    const auto positive = [](const char* rule, double v) {
      if (!(v > 0) || !is_finite(v)) refuse("Admittance", rule, v);
    };
    positive("gain must be > 0 m/s/N", gain);
    positive("turn_gain must be > 0 rad/s/(N·m)", turn_gain);
    positive("cutoff must be > 0 Hz", cutoff);
    positive("speed must be > 0 m/s", speed);
    positive("turn_speed must be > 0 rad/s", turn_speed);
    positive("ramp must be > 0 s", ramp);
    if (!(dead_band >= 0)) refuse("Admittance", "dead_band must be >= 0 N", dead_band);
    if (!(turn_dead_band >= 0)) refuse("Admittance", "turn_dead_band must be >= 0 N·m", turn_dead_band);
  }
};

/// Moves a tool by the force on it: v = G f (1 − b/|f|) for |f| > b, else 0, at most `speed`, with f filtered by a
/// first order, and likewise for torque. So a force above the dead band gives G (|f| − b), without a step at b.
///
/// The filter is exact for a force that is constant over a tick. A spring k of bone and hand makes a loop of the gain
/// G k [1/s], which is stable while G k times the delay of filter and robot together is well below 1.
class Admittance {
 public:
  /// Throws std::invalid_argument if an option is out of range.
  explicit Admittance(const AdmittanceOptions& options = {}) : options_(options) { options_.validate(); }

  [[nodiscard]] const AdmittanceOptions& options() const noexcept { return options_; }

  /// Returns the share of the gain that acts: 1, once `ramp` has passed since a restart.
  [[nodiscard]] double share() const noexcept { return share_; }

  /// Starts from rest: without force, and with a gain that rises from 0.
  void restart() noexcept {
    filtered_ = {};
    share_ = 0;
  }

  /// Returns the twist of T in W for a wrench on the tool about T's origin. A wrench that is not finite counts as zero.
  [[nodiscard]] Twist twist(const Wrenchd& wrench, double dt) noexcept {
    dt = clamped_dt(dt);
    share_ = std::min(share_ + dt / options_.ramp, 1.0);
    const double follow = 1 - std::exp(-2 * std::numbers::pi * options_.cutoff * dt);
    const Wrenchd now = is_finite(wrench) ? wrench : Wrenchd::zero();
    filtered_ += follow * (now + -1.0 * filtered_);
    if (!is_finite(filtered_)) filtered_ = {};  // forces near the largest double
    return {share_ * moved(filtered_.force, options_.gain, options_.dead_band, options_.speed),
            share_ * moved(filtered_.torque, options_.turn_gain, options_.turn_dead_band, options_.turn_speed)};
  }

 private:
  [[nodiscard]] static Vec3d moved(const Vec3d& f, double gain, double dead_band, double fastest) noexcept {
    const double size = bounded_norm(f);
    if (!(size > dead_band)) return Vec3d::Zero();
    return std::min(gain * (size - dead_band), fastest) / size * f;
  }

  AdmittanceOptions options_;
  Wrenchd filtered_;
  double share_ = 0;  // of the gain
};

}  // namespace robots
