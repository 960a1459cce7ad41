// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>
#include <trephine/core/wrench.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Bound on the change of a wrench from tick to tick, so that the hand feels no step, whatever the cause: a tool that
/// slides off an edge, bone that gives way or appears, a jump, a new tool.
///
/// The wrench W counts as that of a spring between the device and a felt tool. The spring has a stiffness k for
/// translation and k_θ for rotation. A rigid tool on convex bone-free space moves no faster than the device, and less
/// far than any point between both (a projection onto a convex set is firmly nonexpansive). So while the device makes a
/// small motion d relative to the bone, the wrench changes by −K d/2 and no more than |K d|/2 besides. Whatever
/// changes it farther may add `release` newtons a second:
///
///     |ΔW + K d/2| <= |K d|/2 + release · dt,    and hence    |ΔW| <= |K d| + release · dt.
///
/// Norms are |(f, τ/r)| of a wrench and k |(δp, r δθ)| of a motion, with the lever r = √(k_θ/k).
///
/// A wrench within the bound passes unchanged, to the bit. Another one stops on its way from the wrench of a felt tool
/// that stands still. So where the wanted wrench has less energy, the spring's energy is lost, as in something viscous,
/// and none goes to the hand.
///
/// A jump counts as no motion. But a hand that is pulled away faster than that moves on: there the wrench first falls
/// as its spring does where the device yields to it, or it would push the hand all the way.
class ReleaseBound {
 public:
  ReleaseBound() = default;
  /// k [N/m], `lever` r [m] > 0, `release` [N/s], which may be infinite. Without a spring for rotation the felt tool
  /// turns with the device; the lever then only says how far the tool's points move as it turns.
  ReleaseBound(double stiffness, double lever, double release, bool has_rotation = true) noexcept {
    set(stiffness, lever, release, has_rotation);
  }
  /// Takes other numbers; the last wrench stays.
  void set(double stiffness, double lever, double release, bool has_rotation = true) noexcept {
    stiffness_ = stiffness;
    last_ = spatial(linear_part(last_), lever_ / lever * angular_part(last_));
    lever_ = lever;
    release_ = release;
    has_rotation_ = has_rotation;
  }

  /// Returns true if some change is too fast.
  [[nodiscard]] bool is_bounded() const noexcept { return is_finite(release_); }

  /// Returns true if the last wrench was not zero.
  [[nodiscard]] bool acts() const noexcept { return last_.squaredNorm() > 0; }
  /// Takes it that no wrench acts on the hand.
  void reset() noexcept { last_.setZero(); }

  /// Takes the device's pose in W at this tick, before `apply`, while a wrench acts. Where it jumped, the spring
  /// unloads by the way that the device went along the wrench, down to none. Bone that jumps unloads nothing.
  void follow(const Posed& X_WT, bool jumped) noexcept {
    if (const double size = length(last_); jumped && size > 0) {
      const Vec6d motion = motion_to(X_WT_, X_WT);
      Vec6d push = spatial(-stiffness_ * linear_part(motion), -stiffness_ * lever_ * angular_part(motion));
      if (!has_rotation_) clear_angular(push);
      last_ *= std::clamp(1 + push.dot(last_ / size) / size, 0.0, 1.0);
    }
    X_WT_ = X_WT;
  }

  /// Changes a wrench about T's origin to the one that the bound allows, after a tick of `dt` [s]. `motion` (δp, δθ) is
  /// the tool's relative to the bone since the last tick, in the wrench's axes. Returns true if the wrench is held
  /// back.
  bool apply(Wrenchd& wrench, const Vec6d& motion, double dt) noexcept {
    const Vec6d wanted = spatial(wrench.force, wrench.torque / lever_);
    Vec6d push = spatial(-stiffness_ * linear_part(motion), -stiffness_ * lever_ * angular_part(motion));
    const double half_motion = 0.5 * push.norm(), radius = half_motion + release_ * dt;
    if (!has_rotation_) clear_angular(push);
    const Vec6d middle = last_ + 0.5 * push;
    if (!is_bounded() || !is_finite(wrench) || length(wanted - middle) <= radius) {
      last_ = wanted;
      return false;
    }
    // From the wrench of a felt tool that stands still toward the wanted one, to where it leaves the ball.
    const Vec6d change = wanted - (last_ + push);
    const Vec6d direction = change / length(change);
    const double along = 0.5 * push.dot(direction);
    const double reach = std::sqrt(std::max(0.0, along * along + radius * radius - 0.25 * push.squaredNorm()));
    last_ += push + (reach - along) * direction;
    wrench = {linear_part(last_), lever_ * angular_part(last_)};
    return true;
  }

 private:
  /// Euclidean length, without overflow of its squares.
  [[nodiscard]] static double length(const Vec6d& v) noexcept {
    const double largest = v.cwiseAbs().maxCoeff();
    return largest > 0 ? largest * (v / largest).norm() : 0.0;
  }

  double stiffness_ = 1, lever_ = 1;
  double release_ = std::numeric_limits<double>::infinity();
  bool has_rotation_ = true;
  Vec6d last_ = Vec6d::Zero();      // the last wrench: (f, τ/r) [N]
  Posed X_WT_ = Posed::Identity();  // the device's at that tick
};

}  // namespace trephine
