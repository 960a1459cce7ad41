// SPDX-License-Identifier: MIT
#pragma once

#include "any_device.hpp"
#include "kinds.hpp"

#include <trephine/device/run_report.hpp>

#include <atomic>
#include <functional>

namespace devices {

/// What a hand found of the wall.
struct WallReport {
  trephine::RunReport run;
  double most_force = 0;  ///< that was sent [N]
};

/// A moment of it, a few times a second, in the servo thread.
struct WallMoment {
  double time = 0;   ///< [s]
  double force = 0;  ///< that was sent [N]
};

/// Lets a hand feel a wall of bone, `kWallBelow` under the middle of the device's workspace, as stiff as the device
/// renders well, for `seconds` or until `quit`.
inline constexpr double kWallBelow = 0.01;  // [m]
[[nodiscard]] WallReport feel_wall(Opened& device, double seconds, const std::atomic<bool>& quit,
                                   const std::function<void(const WallMoment&)>& tell);

/// The hand that holds a simulated device at the wall: it goes down into it, stays, and goes up again.
[[nodiscard]] Hand pushing_hand(double seconds);

}  // namespace devices
