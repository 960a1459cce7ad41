// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/motion.hpp>

#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {

/// The motion from the last tick to this tick.
struct PoseStep {
  Twist twist{};           ///< velocity of the tool in the world, W axes [m/s, rad/s]
  Twist twist_to_bone{};   ///< velocity of the tool in the grid, W axes [m/s, rad/s]
  Posed X_GT_before;       ///< probe at the last tick, in the grid of that tick; this tick's after a gap
  bool continues = false;  ///< a path leads from that tick to this one
};

/// Stores the poses of the last tick, for jumps and the wrench's bound, for twists (stages) and for the burr's path
/// (cuts), the latter two only if they are used. After a gap, twists are zero and there is no path, so no velocity
/// spikes and no tunnel is cut. Gaps are the first tick, a tick after `invalidate`, `restart`, an interval outside
/// [kShortestDt, kLongestDt], and a step faster than kMaxSpeed or kMaxAngularSpeed.
template <bool kTwist, bool kPath, bool kStep = kTwist || kPath>
class PoseHistory {
 public:
  void invalidate() noexcept { valid_ = false; }

  /// Returns true if the tool at X_GT jumped since the last tick, dt [s] ago.
  [[nodiscard]] bool is_jump(const Posed& X_GT, double dt) const noexcept {
    return valid_ && trephine::is_jump(X_GT_, X_GT, dt);
  }

  /// Stores this tick's poses and returns the motion since the last tick. X_WT and X_GT are the tool's poses in world
  /// and grid, dt the measured interval [s].
  [[nodiscard]] PoseStep advance(const Posed& X_WT, const Posed& X_GT, const Mat3d& R_WG, double dt,
                                 bool restart) noexcept {
    PoseStep step{{}, {}, X_GT};
    if (valid_ && !restart && is_usable_dt(dt)) compute_motion(X_WT, X_GT, R_WG, dt, step);
    X_GT_ = X_GT;
    if constexpr (kTwist) X_WT_ = X_WT;
    valid_ = true;
    return step;
  }

 private:
  void compute_motion(const Posed& X_WT, const Posed& X_GT, const Mat3d& R_WG, double dt,
                      PoseStep& step) const noexcept {
    step.X_GT_before = X_GT_;
    if constexpr (!kTwist && !kPath) return;
    const Twist in_G = twist_between(X_GT_, X_GT, dt);
    if (!is_plausible(in_G)) {
      step.X_GT_before = X_GT;
      return;
    }
    step.continues = true;
    if constexpr (kTwist) {
      const Twist in_W = twist_between(X_WT_, X_WT, dt);
      if (is_plausible(in_W)) {
        step.twist = in_W;
        step.twist_to_bone = {product(R_WG, in_G.linear), product(R_WG, in_G.angular)};
      }
    }
  }

  struct NoPose {};
  Posed X_GT_ = Posed::Identity();
  [[no_unique_address]] std::conditional_t<kTwist, Posed, NoPose> X_WT_;
  bool valid_ = false;
};

/// No stage uses twists and no cut the path: no state, no work.
template <>
class PoseHistory<false, false, false> {
 public:
  void invalidate() noexcept {}
  [[nodiscard]] bool is_jump(const Posed&, double) const noexcept { return false; }
};

}  // namespace trephine
