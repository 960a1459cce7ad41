// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/motion.hpp>

#include <type_traits>

namespace trephine {

/// What one tick has to do with the one before.
struct PoseStep {
  Twist twist{};          ///< of the tool in the world, W axes
  Twist twist_to_bone{};  ///< of the tool in the grid, W axes
  Posed X_GT_before;      ///< the probe at the last tick, as it lay in the grid
  Posed X_GC_before;      ///< the cutting pose at the last tick
};

/// The poses of the last tick, kept only for what asks for them: twists (stages) and the way of the burr (carvers).
/// Across a gap there is neither: twists are zero and the way has no length, so that nothing spikes and no tunnel is
/// cut. A gap is: the first tick, a tick after `forget`, `restart`, an interval outside [kShortestDt, kLongestDt], a
/// step faster than kFastestSpeed or kFastestTurn.
template <bool kTwist, bool kWay>
class PoseHistory {
 public:
  void invalidate() noexcept { valid_ = false; }

  /// Takes in this tick's poses: tool in world, tool in grid, cutting pose in grid; dt as measured [s].
  [[nodiscard]] PoseStep advance(const Posed& X_WT, const Posed& X_GT, const Posed& X_GC, const Mat3d& R_WG, double dt,
                                 bool restart) noexcept {
    PoseStep step{{}, {}, X_GT, X_GC};
    if (valid_ && !restart && is_usable_dt(dt)) join(X_WT, X_GT, X_GC, R_WG, dt, step);
    X_GT_ = X_GT;
    if constexpr (kTwist) X_WT_ = X_WT;
    if constexpr (kWay) X_GC_ = X_GC;
    valid_ = true;
    return step;
  }

 private:
  void join(const Posed& X_WT, const Posed& X_GT, const Posed& X_GC, const Mat3d& R_WG, double dt,
            PoseStep& step) const noexcept {
    const Twist in_G = twist_between(X_GT_, X_GT, dt);
    if (!is_plausible(in_G)) return;
    if constexpr (kTwist) {
      const Twist in_W = twist_between(X_WT_, X_WT, dt);
      if (is_plausible(in_W)) {
        step.twist = in_W;
        step.twist_to_bone = {R_WG * in_G.linear, R_WG * in_G.angular};
      }
    }
    if constexpr (kWay) {
      step.X_GT_before = X_GT_;
      if (is_plausible(twist_between(X_GC_, X_GC, dt))) step.X_GC_before = X_GC_;  // a proxy may leap by itself
    }
  }

  template <int kWhich>
  struct Nothing {};
  Posed X_GT_ = Posed::Identity();
  [[no_unique_address]] std::conditional_t<kTwist, Posed, Nothing<0>> X_WT_;
  [[no_unique_address]] std::conditional_t<kWay, Posed, Nothing<1>> X_GC_;
  bool valid_ = false;
};

/// Nobody asks: no state, no work.
template <>
class PoseHistory<false, false> {
 public:
  void invalidate() noexcept {}
};

}  // namespace trephine
