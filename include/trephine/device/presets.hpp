// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>
#include <trephine/render/stiffness_budget.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>

#include <array>
#include <string>
#include <string_view>

namespace trephine {

/// What a scene for a device is made of, by the device's name: a start to tune from, not a promise for the one on your
/// desk. Capabilities are those that CHAI3D publishes; the stack is the one that came out best in `bench/run`
/// (stability.csv): a stiffness budget in the renderer, impact damping that costs little force error and triples the
/// stable stiffness, a controller that takes what energy is left over, and slopes instead of steps.
/// \code
/// const DevicePreset device = device_preset("Premium 1.5 6DOF");
/// HapticScene scene{bone, 300, SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = device.stiffness,
///                                                                       .budget = device.budget}},
///                   HuntCrossley{device.hunt_crossley}, PassivityController{device.passivity},
///                   WrenchRateLimit{device.rate}, device.limits};
/// \endcode
/// A device whose `capabilities.output_dof` is 3 wants `ForceOnly{}` in the list too. Figures are the device's own:
/// where a Registration scales, divide stiffness by the scale and multiply angular stiffness.
struct DevicePreset {
  DeviceCapabilities capabilities;
  double stiffness = 0;  ///< for the renderer's options [N/m]
  StiffnessBudget budget;
  HuntCrossley::Options hunt_crossley;
  PassivityController::Options passivity;
  WrenchRateLimit::Options rate;
  DeviceLimits limits;
};

namespace preset_detail {

struct Device {
  std::string_view name;
  int output_dof;
  double force, torque;       // [N, N·m]
  double stiffness, angular;  // [N/m, N·m/rad]; 0: gives no torque
  double quantum;             // of its position readings [m]; 0: not known
};

/// Maxima at 1 kHz as CHAI3D states them; quanta from data sheets.
inline constexpr std::array<Device, 7> kDevices = {{
    {"Touch", 3, 3.3, 0, 400, 0, 0.055e-3},
    {"PHANTOM Omni", 3, 3.3, 0, 700, 0, 0.055e-3},
    {"Premium 1.5 6DOF", 6, 8.5, 0.188, 800, 0.3, 0.03e-3},
    {"Premium 3.0 6DOF", 6, 22, 0.188, 1000, 0.3, 0},
    {"omega.6", 3, 12, 0, 5000, 0, 0},
    {"sigma.7", 6, 12, 0.2, 4000, 1.0, 0},
    {"Falcon", 3, 8, 0, 3000, 0, 0},
}};

}  // namespace preset_detail

/// The names there are.
[[nodiscard]] inline std::array<std::string_view, preset_detail::kDevices.size()> device_preset_names() {
  std::array<std::string_view, preset_detail::kDevices.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = preset_detail::kDevices[i].name;
  return names;
}

/// Throws std::invalid_argument, with the names there are, for any other.
[[nodiscard]] inline DevicePreset device_preset(std::string_view name) {
  constexpr double kNoTorque = 0.3;  // [N·m/rad] of a budget that nobody feels: as soft as the softest that gives it
  constexpr double kShareOfLeak = 0.7;
  constexpr double kFastestHit = 1.0;  // [m/s] that a rate limit leaves alone
  constexpr double kLever = 0.03;      // [m] relates rates of torque and force
  for (const auto& d : preset_detail::kDevices) {
    if (d.name != name) continue;
    DevicePreset p;
    p.capabilities = {.name = std::string(d.name),
                      .input_dof = 6,
                      .output_dof = d.output_dof,
                      .max_force = d.force,
                      .max_torque = d.torque,
                      .stiffness = d.stiffness,
                      .angular_stiffness = d.angular,
                      .rate = 1000};
    const double angular = d.angular > 0 ? d.angular : kNoTorque;
    p.stiffness = d.stiffness;
    p.budget = {d.stiffness, angular};
    // 1 s/m: at a quantum of .055 mm and 1 kHz the velocity's noise is 5 % of the force; more would be felt.
    p.hunt_crossley = {.lambda = 1.0};
    // Allowed less than the device bears, so that a tremble at its limit dies down.
    p.passivity = {.stiffness = kShareOfLeak * d.stiffness,
                   .angular_stiffness = kShareOfLeak * angular,
                   .quantum = d.quantum,
                   .contact_stiffness = d.stiffness,
                   .contact_angular_stiffness = d.angular > 0 ? d.angular : 0,
                   .damping = 10,
                   .angular_damping = 0.01,
                   .force = 0.4 * d.force,
                   .torque = 0.4 * d.torque,
                   .force_rate = 500,
                   .torque_rate = 10,
                   .reserve = 2e-3};
    p.rate = {.force = d.stiffness * kFastestHit, .torque = d.stiffness * kFastestHit * kLever};
    p.limits = {.force = d.force, .torque = d.torque};
    return p;
  }
  std::string known;
  for (const auto& d : preset_detail::kDevices) known += (known.empty() ? "" : ", ") + std::string(d.name);
  refuse("device_preset", "the device must be one of " + known, name);
}

}  // namespace trephine
