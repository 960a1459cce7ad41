// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/wrench.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

/// How far the wrenches of one setting lie from the truth's, tick by tick.
namespace pick {

using trephine::Vec3d;
using trephine::Wrenchd;

inline constexpr double kLeastForce = 0.05;    ///< [N]: denominators are no smaller, directions not asked for below
inline constexpr double kLeastTorque = 0.001;  ///< [N·m]: denominators are no smaller

/// The smallest of the values that has at least the share `q` of them at or below it; 0 for none.
[[nodiscard]] inline double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const double rank = std::ceil(q * static_cast<double>(values.size()) - 1e-9);
  const auto at = static_cast<std::ptrdiff_t>(std::clamp(rank, 1.0, static_cast<double>(values.size()))) - 1;
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// |got − truth| as a share of the truth, but of no less than `least`.
[[nodiscard]] inline double relative_error(const Vec3d& truth, const Vec3d& got, double least) {
  return (got - truth).norm() / std::max(truth.norm(), least);
}

/// Angle between the two [degrees]; 180 where one of them is zero: a missing force points nowhere.
[[nodiscard]] inline double angle_deg(const Vec3d& a, const Vec3d& b) {
  if (!(a.norm() > 0) || !(b.norm() > 0)) return 180;
  return 180 / std::numbers::pi * std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Force and torque as shares of the truth, direction in degrees.
struct Errors {
  double force_p50 = 0;
  double force_p95 = 0;
  double direction_p99 = 0;
  double torque_p95 = 0;
  int samples = 0;     ///< ticks that count
  int directions = 0;  ///< of these, with a force that is strong enough to have a direction
  int misses = 0;      ///< of those, without any force in the setting's answer

  /// Share of the samples that tell nothing about directions.
  [[nodiscard]] double excluded() const { return samples > 0 ? 1 - static_cast<double>(directions) / samples : 0; }
};

/// What errors may be.
struct Limits {
  double force = 0.035;
  double direction_deg = 5;
  double torque = 0.06;

  /// The worst of the three errors as a share of its limit: 1 just meets them.
  [[nodiscard]] double worst_share(const Errors& e) const {
    return std::max({e.force_p95 / force, e.direction_p99 / direction_deg, e.torque_p95 / torque});
  }
};

/// Errors over the ticks whose `counts` is not 0.
[[nodiscard]] inline Errors compare(std::span<const Wrenchd> truth, std::span<const Wrenchd> got,
                                    std::span<const std::uint8_t> counts) {
  std::vector<double> force, direction, torque;
  Errors e;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (counts[i] == 0) continue;
    ++e.samples;
    force.push_back(relative_error(truth[i].force, got[i].force, kLeastForce));
    torque.push_back(relative_error(truth[i].torque, got[i].torque, kLeastTorque));
    if (truth[i].force.norm() < kLeastForce) continue;
    ++e.directions;
    if (!(got[i].force.norm() > 0)) ++e.misses;
    direction.push_back(angle_deg(truth[i].force, got[i].force));
  }
  e.force_p50 = quantile(force, 0.5);
  e.force_p95 = quantile(std::move(force), 0.95);
  e.direction_p99 = quantile(std::move(direction), 0.99);
  e.torque_p95 = quantile(std::move(torque), 0.95);
  return e;
}

/// What a tick can say: nothing in the air, beyond the device's limits, or where the truth is not known.
struct Ticks {
  std::vector<std::uint8_t> counts;
  int free = 0;       ///< the truth is no contact, and so is the check
  int beyond = 0;     ///< more than the device can give
  int undecided = 0;  ///< two very fine settings differ by more than the limits: a knife's edge between two answers
  int used = 0;

  [[nodiscard]] double undecided_share() const {
    return used + undecided > 0 ? static_cast<double>(undecided) / (used + undecided) : 0;
  }
};

/// `check` is the answer of a setting half as fine as the truth.
[[nodiscard]] inline Ticks sort_ticks(std::span<const Wrenchd> truth, std::span<const Wrenchd> check,
                                      const Limits& limits, double most_force, double most_torque) {
  Ticks t;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double f = truth[i].force.norm();
    const double m = truth[i].torque.norm();
    const bool in_air = f == 0 && m == 0 && check[i].force.norm() == 0 && check[i].torque.norm() == 0;
    const bool differ = relative_error(truth[i].force, check[i].force, kLeastForce) > limits.force ||
                        relative_error(truth[i].torque, check[i].torque, kLeastTorque) > limits.torque ||
                        (f >= kLeastForce && angle_deg(truth[i].force, check[i].force) > limits.direction_deg);
    const bool beyond = f > most_force || m > most_torque;
    const bool counts = !in_air && !beyond && !differ;
    t.counts.push_back(counts ? 1 : 0);
    ++(in_air ? t.free : beyond ? t.beyond : differ ? t.undecided : t.used);
  }
  return t;
}

}  // namespace pick
