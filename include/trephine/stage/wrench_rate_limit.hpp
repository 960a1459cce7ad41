// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>
#include <cmath>

namespace trephine {

/// The wrench changes by at most `force` newtons and `torque` newton metres a second: steps of a contact law (a vertex
/// that enters, a wall that is carved away, a jump) reach the hand as slopes. What lies within the rate passes
/// unchanged, to the bit.
///
/// The price is lag while it limits, which a stiff wall pays in stability: a spring of stiffness K struck at speed v
/// asks for K v (800 N/m at .2 m/s: 160 N/s), and the rate must be above that or the wall feels soft and springs back
/// late. Choose it from the fastest hit that matters, not from the steps to be hidden.
///
/// Change is counted from the wrench that went out a tick ago, after limits: clipped newtons need not be unwound. After
/// a tick that sent nothing it comes back from zero. List it last before DeviceLimits, whose clipping to a ball makes
/// no change larger. State: that wrench. Haptic thread.
class WrenchRateLimit {
 public:
  static constexpr bool kUsesTwist = false;

  struct Options {
    double force = 600;  ///< [N/s], > 0
    double torque = 20;  ///< [N·m/s], > 0

    /// Throws std::invalid_argument.
    void validate() const {
      if (!(force > 0) || !std::isfinite(force)) refuse("WrenchRateLimit", "force must be finite and > 0 N/s", force);
      if (!(torque > 0) || !std::isfinite(torque))
        refuse("WrenchRateLimit", "torque must be finite and > 0 N·m/s", torque);
    }
  };

  /// Throws std::invalid_argument where an option is out of range.
  explicit WrenchRateLimit(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Takes options that `validate` accepted; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void reset() noexcept { held_ = next_ = Wrenchd::zero(); }

  void begin_tick() noexcept {
    held_ = next_;  // a tick that ends early sends zero
    next_ = Wrenchd::zero();
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    limit(wrench.force, held_.force, options_.force * context.dt);
    limit(wrench.torque, held_.torque, options_.torque * context.dt);
    next_ = wrench;
  }

  /// The wrench as it leaves the scene.
  void sent(const Wrenchd& wrench) noexcept { next_ = wrench; }

 private:
  /// By the largest component first, so that squares of a wrench of 1e200 do not overflow. A non-finite one is left for
  /// the scene to see.
  static void limit(Vec3d& to, const Vec3d& from, double most) noexcept {
    const Vec3d change = to - from;
    const double largest = std::max({std::abs(change.x()), std::abs(change.y()), std::abs(change.z())});
    if (!(largest > 0) || !is_finite(change)) return;
    const Vec3d u = change / largest;
    const double norm = u.norm();
    if (largest * norm <= most) return;
    to = from + u * (most / norm);
  }

  Options options_;
  Wrenchd held_, next_;  // sent a tick ago; about to be sent
};

}  // namespace trephine
