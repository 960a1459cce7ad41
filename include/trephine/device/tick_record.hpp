// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/device/device.hpp>

#include <cstdint>

namespace trephine {

/// All of one servo tick: what an observer gets to see after the force has been committed.
struct TickRecord {
  std::uint64_t index = 0;  ///< from 0 in each run
  double time = 0;          ///< since the first tick of the run [s]
  double dt = 0;            ///< what the scene was given [s]
  DeviceState state;        ///< what was read
  TickInput input;          ///< the same in the world
  TickResult result;        ///< what the scene answered, before the ramp
  Wrenchd sent;             ///< what was written: about H in D axes, after ramp and limits
  double ramp = 0;          ///< 0 to 1, the factor in `sent`
  DeviceStatus read_status = DeviceStatus::kOk;
  DeviceStatus write_status = DeviceStatus::kOk;
};

/// Sees nothing, costs nothing.
struct NoObserver {
  void operator()(const TickRecord&) const noexcept {}
};

}  // namespace trephine
