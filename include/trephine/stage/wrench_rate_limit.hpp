// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>

#include <algorithm>
#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// Limits the rate of change of the wrench to `force` newtons and `torque` newton metres a second. Steps of a contact
/// law (a vertex that enters, a wall that is carved away, a jump) become slopes. Slower changes pass unchanged, to the
/// bit.
///
/// The price is lag while the limit acts, which costs stability at a stiff wall. A spring of stiffness K struck at
/// speed v rises by K v (800 N/m at 0.2 m/s: 160 N/s). The rate must exceed that, or the wall feels soft and rebounds
/// late. Choose the rate from the fastest hit that matters, not from the steps to be hidden.
/// Its lag feeds a bounce: Surface pressed with 10 N got 15 J in a minute at 190 N/s (`bench/README.md`). The coupled
/// tool seldom needs it.
///
/// The change is relative to the wrench that left the scene a tick ago, after all limits, so clipped force needs no
/// unwinding. After a tick that sent zero the wrench rises from zero; a reset of the scene changes nothing. List this
/// stage last before DeviceLimits, whose projection onto a ball makes no change larger. State: the last wrench sent.
/// Haptic thread.
class WrenchRateLimit {
 public:
  static constexpr bool kUsesTwist = false;

  struct Options {
    double force = 600;  ///< fastest change of the force [N/s], > 0
    double torque = 20;  ///< fastest change of the torque [N·m/s], > 0

    /// Throws std::invalid_argument if an option is out of range.
    void validate() const {
      if (!(force > 0) || !is_finite(force)) refuse("WrenchRateLimit", "force must be finite and > 0 N/s", force);
      if (!(torque > 0) || !is_finite(torque)) refuse("WrenchRateLimit", "torque must be finite and > 0 N·m/s", torque);
    }
  };

  /// Throws std::invalid_argument if an option is out of range.
  explicit WrenchRateLimit(const Options& options) : options_(options) { options_.validate(); }

  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options, which `validate` must accept; between ticks, haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }

  void forget_wrench() noexcept { previous_ = Wrenchd::zero(); }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    limit(wrench.force, previous_.force, options_.force * context.dt);
    limit(wrench.torque, previous_.torque, options_.torque * context.dt);
  }

  /// Stores the wrench that leaves the scene.
  void sent(const Wrenchd& wrench) noexcept { previous_ = wrench; }

 private:
  /// Limits the change from `from` to `to`. Scales by the largest component first, so that squares of 1e200 do not
  /// overflow. A non-finite change stays, and the scene then sends zero.
  static void limit(Vec3d& to, const Vec3d& from, double max_change) noexcept {
    const Vec3d change = to - from;
    const double largest = std::max({std::abs(change.x()), std::abs(change.y()), std::abs(change.z())});
    if (!(largest > 0) || !is_finite(change)) return;
    const Vec3d u = change / largest;
    const double norm = u.norm();
    if (largest * norm <= max_change) return;
    to = from + u * (max_change / norm);
  }

  Options options_;
  Wrenchd previous_;  // sent a tick ago
};

}  // namespace trephine
