// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/stage/carver.hpp>

#include <tuple>
#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Chooses the pose in G at which a scene's carvers cut: the renderer's cutting pose for the cut that the parts make,
/// in time, at once or under pressure.
///
/// A renderer that gives cuts at once a speed (`cutting_pose(dt)`) bites at most every `kShortestBite`: a bite makes
/// bone's surface anew. Between two bites the pose stays, so that nothing is cut.
template <class ContactRenderer, class... Parts>
class CuttingPoses {
 public:
  using Parted = std::tuple<Parts...>;

  /// Returns the pose of this tick. A cut under pressure may go ahead by `pressed_way` [m]; `dt` is the tick's
  /// duration [s]; `restarts` tells that contact starts anew.
  [[nodiscard]] Posed next(const ContactRenderer& renderer, const Parted& parts, double pressed_way, double dt,
                           bool restarts) noexcept {
    if constexpr (kBites) {
      // A cut by pressure has its own pose at each tick.
      const bool bites = any_part(parts, [](const auto& part) { return cuts_at_once(part); }) &&
                         !any_part(parts, [](const auto& part) { return cuts_under_pressure(part); });
      if (bites) {
        if (bites_.is_due(dt, restarts)) bites_.X_GC = current(renderer, parts, pressed_way);
        return bites_.X_GC;
      }
      bites_.has_last = false;
    }
    return current(renderer, parts, pressed_way);
  }

  /// Returns the renderer's cutting pose as it is now.
  [[nodiscard]] Posed current(const ContactRenderer& renderer, const Parted& parts,
                              double pressed_way = 0) const noexcept {
    if constexpr ((kCutsUnderPressure<Parts> || ...) && requires { renderer.pressure_cutting_pose(pressed_way); })
      if (any_part(parts, [](const auto& part) { return cuts_under_pressure(part); }))
        return renderer.pressure_cutting_pose(pressed_way).template cast<double>();
    if constexpr (kBites)
      if (any_part(parts, [](const auto& part) { return cuts_at_once(part); }))
        return renderer.cutting_pose(bites_.time).template cast<double>();
    return renderer.cutting_pose().template cast<double>();
  }

  /// Returns the time that the last bite stands for [s]; 0 where nothing bites.
  [[nodiscard]] double bite_time() const noexcept {
    if constexpr (kBites) return bites_.time;
    return 0;
  }

  void reset() noexcept { bites_ = {}; }

 private:
  static constexpr bool kBites = (kCutsAtOnce<Parts> || ...) && requires(const ContactRenderer& r, double dt) {
    r.cutting_pose(dt);
  };
  /// Bites of a cut at once: the pose of the last one stays until the next is due.
  struct Bites {
    bool has_last = false;
    double since = 0;  // time since the last bite [s]
    double time = 0;   // that the last one stands for [s]
    Posed X_GC = Posed::Identity();

    [[nodiscard]] bool is_due(double dt, bool restarts) noexcept {
      since += dt;
      if (has_last && !restarts && since < kShortestBite) return false;
      time = has_last && !restarts ? since : dt;
      since = 0;
      has_last = true;
      return true;
    }
  };
  struct NoBites {};

  template <class Predicate>
  [[nodiscard]] static bool any_part(const Parted& parts, Predicate&& is) noexcept {
    return std::apply([&](const auto&... part) { return (is(part) || ...); }, parts);
  }

  [[no_unique_address]] std::conditional_t<kBites, Bites, NoBites> bites_{};
};

}  // namespace trephine::detail
