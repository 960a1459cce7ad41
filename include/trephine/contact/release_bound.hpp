// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trephine {

/// Bound on how fast the coupling lets go where bone gives way, so that the hand feels no step: the tool that is felt
/// follows the virtual tool at a limited speed.
///
/// The coupling's extension is the small motion from the tool to the device. Its size is |(δp, r δθ)|, with
/// r² = k_θ / k the lever at which both springs hold the same energy. On firm bone the device's own motion makes it
/// smaller by no more than the size of that motion, less the part that pushes farther in. What is lost beyond, the tool
/// has gained on the device. It gains `speed` a second at most, and goes the rest of its way in the next ticks.
///
/// So the tool moves only where the coupling pulls it. The springs' energy goes into its motion and is lost, as in
/// something viscous, and none goes to the hand. A force that rises rises at once.
class ReleaseBound {
 public:
  ReleaseBound() = default;
  /// `speed` in [m/s]; `lever` r [m]. The springs' forces grow up to the extensions `max_shift` [m] and `max_turn`
  /// [rad]; what lies beyond is let go at once, as it changes no force.
  ReleaseBound(double speed, double lever, double max_shift, double max_turn) noexcept
      : speed_(speed), lever_(lever), max_shift_(max_shift), max_turn_(max_turn) {}

  /// Forgets the last extension.
  void reset() noexcept { last_.setZero(); }

  /// Changes the extension that bone asks for, at the end of a tick of `dt` [s], to the one that the bound allows. The
  /// device went from `before` to `now`. Returns true if the tool is held back.
  [[nodiscard]] bool apply(Vec6d& extension, const Posed& before, const Posed& now, double dt) noexcept {
    const double before_motion = size(last_) - speed_ * dt, wanted = size(extension);
    bool is_held_back = false;
    if (wanted < before_motion) {
      const Vec6d device = motion_to(before, now);
      const double pushed = std::max(0.0, dot(device, last_)) / dot(last_, last_);
      const double least = before_motion - size(device - pushed * last_);
      is_held_back = wanted < least && std::isfinite(least);
      if (is_held_back) {
        // On the way from the extension of a tool that stands still to the wanted one: |held + f way| = least.
        const Vec6d held = within_limits(last_ + device), way = extension - held;
        const double along = dot(held, way), square = dot(way, way);
        const double root = along * along - square * (dot(held, held) - least * least);
        extension = held + std::clamp((-along - std::sqrt(std::max(0.0, root))) / square, 0.0, 1.0) * way;
      }
    }
    last_ = within_limits(extension);
    return is_held_back;
  }

 private:
  [[nodiscard]] Vec6d within_limits(const Vec6d& v) const noexcept {
    Vec3d shift = linear_part(v), turn = angular_part(v);
    if (shift.norm() > max_shift_) shift *= max_shift_ / shift.norm();
    if (turn.norm() > max_turn_) turn *= max_turn_ / turn.norm();
    return spatial(shift, turn);
  }
  [[nodiscard]] double dot(const Vec6d& a, const Vec6d& b) const noexcept {
    return linear_part(a).dot(linear_part(b)) + lever_ * lever_ * angular_part(a).dot(angular_part(b));
  }
  [[nodiscard]] double size(const Vec6d& v) const noexcept { return std::sqrt(dot(v, v)); }

  double speed_ = std::numeric_limits<double>::infinity();
  double lever_ = 0, max_shift_ = 0, max_turn_ = 0;
  Vec6d last_ = Vec6d::Zero();
};

}  // namespace trephine
