// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/cutting_force_options.hpp>
#include <trephine/tool/motors.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options with a motor's speed, stall torque and inertia:
/// `driven_by({.edges = tool.edges}, motor_by_name("air-turbine"))`.
[[nodiscard]] inline CuttingForceOptions driven_by(CuttingForceOptions options, const Motor& motor) noexcept {
  options.speed = motor.speed;
  options.stall_torque = motor.stall_torque;
  options.inertia = motor.inertia;
  return options;
}

}  // namespace trephine
