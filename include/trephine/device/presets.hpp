// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/stiffness_budget.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>

#include <array>
#include <string>
#include <string_view>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a scene for a device, by the device's name: a starting point for tuning, and no guarantee for an
/// individual device. CHAI3D publishes the capabilities.
/// \code
/// const DevicePreset device = device_preset("Touch");
/// HapticScene scene{bone, 300, CoupledToolRenderer{burr, device}, Cutting{}, device.limits};
/// \endcode
/// A device without torque, as this one, needs no thought: the coupled tool then has its rotation. Surface needs the
/// stages that are the best of `bench/run` for it (stability.csv). A stiffness budget limits the renderer. Impact
/// damping triples the stable stiffness at little force error. A passivity controller dissipates the remaining energy,
/// and a rate limit turns steps into slopes.
/// \code
/// const SurfaceOptions options{.stiffness = device.stiffness, .budget = device.budget};
/// HapticScene scene{bone, 300, SurfaceApproxRenderer{tool, options}, HuntCrossley{device.hunt_crossley},
///                   PassivityController{device.passivity}, WrenchRateLimit{device.rate}, device.limits};
/// \endcode
/// All numbers are at the device: with a Registration that scales, divide stiffness by the scale and multiply angular
/// stiffness by it.
struct DevicePreset {
  DeviceCapabilities capabilities;
  double stiffness = 0;  ///< option of the renderer [N/m]
  StiffnessBudget budget;
  HuntCrossley::Options hunt_crossley;
  PassivityController::Options passivity;
  WrenchRateLimit::Options rate;
  DeviceLimits limits;

  /// The coupled tool's: stiffness, and the device's largest force and torque.
  operator CoupledOptions() const noexcept {  // NOLINT(google-explicit-constructor): so a renderer takes the preset
    return {.stiffness = stiffness,
            .rotational_stiffness = budget.angular,
            .force = capabilities.max_force,
            .torque = capabilities.max_torque};
  }
};

namespace preset_detail {

struct Device {
  std::string_view name;
  int output_dof;
  double force, torque;       // [N, N·m]
  double stiffness, angular;  // [N/m, N·m/rad]; 0: gives no torque
  double quantum;             // of position readings [m]; 0: unknown
};

/// Maxima at 1 kHz as published by CHAI3D; quanta from data sheets.
inline constexpr std::array<Device, 7> kDevices = {{
    {"Touch", 3, 3.3, 0, 400, 0, 0.055e-3},
    {"PHANTOM Omni", 3, 3.3, 0, 700, 0, 0.055e-3},
    {"Premium 1.5 6DOF", 6, 8.5, 0.188, 800, 0.3, 0.03e-3},
    {"Premium 3.0 6DOF", 6, 22, 0.188, 1000, 0.3, 0},
    {"omega.6", 3, 12, 0, 5000, 0, 0},
    {"sigma.7", 6, 12, 0.2, 4000, 1.0, 0},
    {"Falcon", 3, 8, 0, 3000, 0, 0},
}};

// Numbers that decide; `bench/run` measures their joint effect (stability.csv).
inline constexpr double kRate = 1000;                 // [Hz] of all published maxima
inline constexpr double kAngularWithoutTorque = 0.3;  // [N·m/rad] budget of a device without torque: as the softest
inline constexpr double kLambda = 1.0;                // [s/m] velocity noise of 0.055 mm at 1 kHz is 5 % of the force
inline constexpr double kAllowedShare = 0.7;          // of the device's stiffness: vibration at its limit decays
inline constexpr double kInjectedShare = 0.4;         // of the device's force and torque
inline constexpr double kDamping = 10;                // [N·s/m] largest injected
inline constexpr double kAngularDamping = 0.01;       // [N·m·s/rad]
inline constexpr double kForceRate = 500;             // [N/s] of the injection
inline constexpr double kTorqueRate = 10;             // [N·m/s]
inline constexpr double kReserve = 2e-3;              // [J] small, because stored energy is counted
inline constexpr double kMaxHitSpeed = 1.0;           // [m/s] hits up to this speed pass the rate limit unchanged
inline constexpr double kLever = 0.03;                // [m] ratio of torque rate to force rate

}  // namespace preset_detail

/// Returns the names of all presets.
[[nodiscard]] inline std::array<std::string_view, preset_detail::kDevices.size()> device_preset_names() {
  std::array<std::string_view, preset_detail::kDevices.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = preset_detail::kDevices[i].name;
  return names;
}

/// Returns the preset of a device. Throws std::invalid_argument, with the list of names, for an unknown name.
[[nodiscard]] inline DevicePreset device_preset(std::string_view name) {
  namespace detail = preset_detail;
  for (const auto& d : detail::kDevices) {
    if (d.name != name) continue;
    DevicePreset p;
    p.capabilities = {.name = std::string(d.name),
                      .input_dof = 6,
                      .output_dof = d.output_dof,
                      .max_force = d.force,
                      .max_torque = d.torque,
                      .stiffness = d.stiffness,
                      .angular_stiffness = d.angular,
                      .rate = detail::kRate};
    const double angular = d.angular > 0 ? d.angular : detail::kAngularWithoutTorque;
    p.stiffness = d.stiffness;
    p.budget = {d.stiffness, angular};
    p.hunt_crossley = {.lambda = detail::kLambda};
    p.passivity = {.stiffness = detail::kAllowedShare * d.stiffness,
                   .angular_stiffness = detail::kAllowedShare * angular,
                   .quantum = d.quantum,
                   .contact_stiffness = d.stiffness,
                   .contact_angular_stiffness = d.angular > 0 ? d.angular : 0,
                   .damping = detail::kDamping,
                   .angular_damping = detail::kAngularDamping,
                   .force = detail::kInjectedShare * d.force,
                   .torque = detail::kInjectedShare * d.torque,
                   .force_rate = detail::kForceRate,
                   .torque_rate = detail::kTorqueRate,
                   .reserve = detail::kReserve};
    p.rate = {.force = d.stiffness * detail::kMaxHitSpeed,
              .torque = d.stiffness * detail::kMaxHitSpeed * detail::kLever};
    p.limits = {.force = d.force, .torque = d.torque};
    return p;
  }
  std::string known;
  for (const auto& d : detail::kDevices) known += (known.empty() ? "" : ", ") + std::string(d.name);
  refuse("device_preset", "the device must be one of " + known, name);
}

}  // namespace trephine
