// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/cutting_part.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/voxel/cut_policy.hpp>

#include <algorithm>
#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Shortest time between two cuts at once where the renderer gives them a speed (`cutting_pose(dt)`) [s]. A cut makes
/// bone's surface anew, which at 40 kHz takes longer than a tick.
inline constexpr double kShortestBite = 1e-3;

namespace detail {

/// Where a head goes in a tick, in G; both poses are equal without a path.
struct CutStroke {
  Posed from, to;
};

/// The pose at which a scene's head cuts, by the kind of its cut, and the stroke to it from the last tick's.
template <bool kMayBeAtOnce, bool kMayBeByPressure>
class CuttingPose {
 public:
  /// Returns the stroke of this tick. A cut by pressure may go ahead by `advance` [m]. Cuts at once that are done in
  /// `turns` stand for as many ticks.
  template <class R>
  [[nodiscard]] CutStroke next(const R& renderer, CutKind kind, double advance, const CutTick& tick, bool follow_probe,
                               int turns = 1) noexcept {
    const Posed X_GC = next_pose(renderer, kind, advance, tick, turns);
    // A proxy may jump on its own.
    const bool joined = tick.continues && is_plausible(twist_between(X_GC_, X_GC, std::max(tick.dt, bites_.time)));
    const CutStroke stroke{joined ? X_GC_ : X_GC, X_GC};
    X_GC_ = X_GC;
    return follow_probe && is_finite(X_GC) ? CutStroke{tick.X_GT_before, tick.X_GT} : stroke;
  }

  /// Returns the renderer's cutting pose as it is now.
  template <class R>
  [[nodiscard]] Posed current(const R& renderer, CutKind kind, double advance = 0) const noexcept {
    if constexpr (kMayBeByPressure && CutsByPressure<R>)
      if (kind == CutKind::kByPressure) return renderer.pressure_cutting_pose(advance).template cast<double>();
    if constexpr (kMayBeAtOnce && CutsAtSpeed<R>)
      if (kind == CutKind::kAtOnce) return renderer.cutting_pose(bites_.time).template cast<double>();
    return renderer.cutting_pose().template cast<double>();
  }

 private:
  template <class R>
  [[nodiscard]] Posed next_pose(const R& renderer, CutKind kind, double advance, const CutTick& tick,
                                int turns) noexcept {
    if constexpr (kMayBeAtOnce && CutsAtSpeed<R>) {
      if (kind == CutKind::kAtOnce) {
        // Between two bites the pose stays, so that nothing is cut.
        if (bites_.is_due(tick.dt, tick.restarts, turns)) bites_.X_GC = current(renderer, kind);
        return bites_.X_GC;
      }
      bites_.has_last = false;
    }
    return current(renderer, kind, advance);
  }

  /// Bites of a cut at once: the pose of the last one stays until the next is due.
  struct Bites {
    bool has_last = false;
    double since = 0;  // time since the last bite [s]
    double time = 0;   // that the last one stands for [s]
    Posed X_GC = Posed::Identity();

    [[nodiscard]] bool is_due(double dt, bool restarts, int turns) noexcept {
      since += dt;
      if (has_last && !restarts && since < kShortestBite) return false;
      time = std::max(has_last && !restarts ? since : dt, turns * dt);
      since = 0;
      has_last = true;
      return true;
    }
  };
  /// Bites of a cut that is never at once.
  struct NoBites {
    static constexpr double time = 0;
  };

  [[no_unique_address]] std::conditional_t<kMayBeAtOnce, Bites, NoBites> bites_;
  Posed X_GC_ = Posed::Identity();  // at the last tick
};

}  // namespace detail

}  // namespace trephine
