// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace trephine {

/// Places of a ball that bone held when the last tick ended, let go over ticks. On rough bone a deepest place comes to
/// lie on the slope to a deeper one, and is none any more: a tool that it held would fall in within a tick. Whatever
/// point of a ball is in bone may be held, so it keeps what it had, less by part each tick, as far as nothing that is
/// found close by does. Equal parts, as what a spring of such stiffness leaves to the hand doubles when it halves.
/// Allocates at construction alone.
class FadingPlaces {
 public:
  struct Place {
    int vertex = 0;
    Vec3d lever = Vec3d::Zero();  ///< from T's origin, in G axes [m]
    double weight = 0;            ///< its share of k before what is found close by takes part of it
  };

  explicit FadingPlaces(int most) : held_(static_cast<std::size_t>(most)) {}

  void forget() noexcept { count_ = 0; }

  /// A tick begins: what bone holds is `found`, contacts in the order of their vertices, the ball's below `ball`.
  template <class Contact>
  void begin(std::span<const Contact> found, int ball) noexcept {
    forget();
    for (const Contact& c : found) {
      const double weight = kKept * c.weight;
      if (c.vertex < ball && weight >= kLeast && count_ < held_.size()) held_[count_++] = {c.vertex, c.lever, weight};
    }
  }

  /// Calls hold(place, weight) with those that `found` does not hold within `close` [m].
  template <class Contact, class Hold>
  void each(std::span<const Contact> found, double close, Hold&& hold) const noexcept {
    const std::span<const Place> held(held_.data(), count_);
    for (const Place& p : held) {
      double there = 0, before = 0;
      for (const Contact& c : found) there += c.weight * near(c.lever, p.lever, close);
      for (const Place& other : held) before += other.weight * near(other.lever, p.lever, close);
      const double weight = p.weight * (1 - there / before);
      if (weight > kLeast) hold(p, weight);
    }
  }

 private:
  static constexpr double kKept = 0.7;    // of a weight, from tick to tick
  static constexpr double kLeast = 1e-4;  // weight, below which a place is let go

  [[nodiscard]] static double near(const Vec3d& a, const Vec3d& b, double close) noexcept {
    return std::max(0.0, 1 - (a - b).squaredNorm() / (close * close));
  }

  std::vector<Place> held_;  // the first `count_`; of one size, which copies keep
  std::size_t count_ = 0;
};

}  // namespace trephine
