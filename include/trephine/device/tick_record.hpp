// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/device/device.hpp>

#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// Data of one servo tick, which observers receive after the force is committed.
struct TickRecord {
  std::uint64_t index = 0;  ///< from 0 in each run
  double time = 0;          ///< since the first tick of the run [s]
  double dt = 0;            ///< interval passed to the scene [s]
  DeviceState state;        ///< reading of the device
  TickInput input;          ///< tool pose in the world and spindle, as passed to the scene
  TickResult result;        ///< result of the scene, before the ramp
  Wrenchd sent;             ///< written wrench, about H in D axes, after ramp and limits
  double ramp = 0;          ///< gain of the ramp in `sent`, 0 to 1
  DeviceStatus read_status = DeviceStatus::kOk;
  DeviceStatus write_status = DeviceStatus::kOk;
};

/// An observer that does nothing.
struct NoObserver {
  void operator()(const TickRecord&) const noexcept {}
};

}  // namespace trephine
