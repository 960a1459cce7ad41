// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/structure/membrane.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Where the membranes of structures are torn. A tear is a round place about an axis in S. How deep a point is in the
/// structure counts there as σ times what it is, with
///
///     σ = 1 − open (1 − rest) (1 − (r / radius)²)²,    r < radius from the axis,
///
/// where `open` grows from 0 to 1 within the membrane's `tear_time`. σ never rises. Haptic thread; takes no memory.
class MembraneTears {
 public:
  static constexpr std::size_t kMost = 64;  ///< further ruptures widen the structure's nearest tear

  /// Returns the number of places where a structure is torn.
  [[nodiscard]] int count(int structure) const noexcept {
    const std::span<const Tear> all = torn();
    return static_cast<int>(
        std::count_if(all.begin(), all.end(), [=](const Tear& t) { return t.structure == structure; }));
  }
  [[nodiscard]] bool none() const noexcept { return count_ == 0; }
  /// Returns the energy that was lost in tearing [J].
  [[nodiscard]] double dissipated() const noexcept { return dissipated_; }
  void dissipate(double energy) noexcept { dissipated_ += energy; }
  /// Mends all.
  void clear() noexcept {
    count_ = 0;
    dissipated_ = 0;
  }

  /// Lessens the depth of a point of S in a structure by σ, with the depth's gradient [1].
  void weaken(int structure, const Vec3d& p_S, double& depth, Vec3d& gradient_S) const noexcept {
    for (const Tear& t : torn()) {
      if (t.structure != structure) continue;
      const Vec3d across = off_axis(t, p_S);
      const double inner = 1 - across.squaredNorm() / (t.radius * t.radius);
      if (!(inner > 0)) continue;
      const double most = t.share * (1 - t.rest), kept = 1 - most * inner * inner;
      gradient_S = kept * gradient_S + (depth * most * 4 * inner / (t.radius * t.radius)) * across;
      depth *= kept;
    }
  }

  /// Tears the membrane of a structure at a point of S, for a tick of dt [s]: widens a tear that is there by its part
  /// of `radius` [m], or begins one of that radius. `gradient_at(p_S, gradient_S)` gives the gradient of the
  /// structure's distance, or returns false. Returns true if anything tore.
  template <class GradientAt>
  bool tear(int structure, const Vec3d& p_S, double radius, const Membrane& membrane, double dt,
            GradientAt&& gradient_at) noexcept {
    Tear* nearest = nullptr;
    double least = 0;
    for (Tear& t : torn()) {
      if (t.structure != structure) continue;
      const double distance = off_axis(t, p_S).norm() - t.radius;
      if (nearest == nullptr || distance < least) nearest = &t, least = distance;
    }
    const bool is_full = count_ == kMost;
    if (nearest != nullptr && (least < 0 || is_full)) {
      if (nearest->share < 1) return false;  // it opens already
      nearest->radius += radius * std::min(1.0, dt / nearest->time);
      return true;
    }
    if (is_full) return false;
    Vec3d axis;
    if (!gradient_at(p_S, axis) || !(axis.norm() > 0)) return false;
    tears_[count_++] = {structure, p_S, axis.normalized(), radius, 0, membrane.rest, membrane.tear_time};
    return true;
  }
  /// Goes on with what tears, for dt [s]; returns true if there is any.
  bool open(double dt) noexcept {
    bool any = false;
    for (Tear& t : torn()) {
      if (!(t.share < 1)) continue;
      t.share = std::min(1.0, t.share + dt / t.time);
      any = true;
    }
    return any;
  }

 private:
  struct Tear {
    int structure = 0;
    Vec3d p_S = Vec3d::Zero(), axis_S = Vec3d::UnitZ();
    double radius = 0, share = 0;  // [m], open share from 0 to 1
    double rest = 0, time = 0;     // of its membrane
  };
  [[nodiscard]] std::span<Tear> torn() noexcept { return {tears_.data(), count_}; }
  [[nodiscard]] std::span<const Tear> torn() const noexcept { return {tears_.data(), count_}; }
  [[nodiscard]] static Vec3d off_axis(const Tear& t, const Vec3d& p_S) noexcept {
    const Vec3d from = p_S - t.p_S;
    return from - t.axis_S.dot(from) * t.axis_S;
  }

  std::array<Tear, kMost> tears_{};
  std::size_t count_ = 0;  // of tears_
  double dissipated_ = 0;  // [J], true
};

}  // namespace trephine
