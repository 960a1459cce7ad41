// SPDX-License-Identifier: MIT
#pragma once

#include "stability/closed_loop.hpp"
#include "stability/places.hpp"

#include <string>
#include <vector>

/// The devices and hands that the loops are closed with, and how a hand presses a tool into a place.
namespace trephine::bench {

inline constexpr double kDeviceMass = 0.045;  // [kg] a desktop device

/// What a closed loop is swept over.
struct Case {
  double damping = 0.5;  ///< of the device [N s/m]
  int delay = 0;         ///< [ticks]
  std::string hand = "none";
  double friction = 0;  ///< the device's, Coulomb [N]
  double quantum = 0;   ///< of its encoders [m]

  [[nodiscard]] std::string text() const;
  [[nodiscard]] SimulatedDeviceOptions device() const;
  /// Greatest stable stiffness of a linear wall: (b + b_h) / (T/2 + dT) [N/m].
  [[nodiscard]] double theory() const;
  bool operator==(const Case&) const = default;
};

/// A light hand, one factor changed at a time, then `count` combinations of all of them from a fixed seed.
[[nodiscard]] std::vector<Case> swept_cases(int count);

/// The hand presses the tool into a place with about `newton`; nobody's hand is a constant force there.
[[nodiscard]] LoopOptions press(const Place& place, const Setup& setup, const SimulatedDeviceOptions& device,
                                double newton = 1);

/// The way in that it presses along: of a slot toward floor and side, of a hole to its side.
[[nodiscard]] Vec3d way_in(const Place& place);

/// The force that presses: 1 N, less where the wall would be so soft that the ball sinks in beyond half its radius.
[[nodiscard]] double bias_for(double K);

/// Only what acts along n: nothing slides away, as in one dimension.
[[nodiscard]] Law along(Law law, Vec3d n);

}  // namespace trephine::bench
