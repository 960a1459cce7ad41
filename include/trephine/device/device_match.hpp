// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>
#include <trephine/device/registration.hpp>
#include <trephine/device/tickable_scene.hpp>

#include <cmath>
#include <concepts>
#include <sstream>
#include <string>
#include <vector>

/// Compares a scene with a device: warnings before a run, and limits of the wrench at each tick.
namespace trephine::inline TREPHINE_ALIGNED {

/// Returns one sentence for each mismatch between a scene and the device that will render it at `rate` [Hz], after the
/// scene's own warnings.
template <TickableScene Scene>
[[nodiscard]] std::vector<std::string> match_device(const Scene& scene, const DeviceCapabilities& device,
                                                    const Registration& registration, double rate) {
  std::vector<std::string> warnings;
  if constexpr (requires {
                  { scene.warnings() } -> std::convertible_to<std::vector<std::string>>;
                })
    warnings = scene.warnings();
  const auto warn = [&](const auto&... parts) {
    std::ostringstream s;
    s << "trephine::ServoLoop: ";
    (s << ... << parts);
    warnings.push_back(s.str());
  };
#if !defined(__OPTIMIZE__) && (!defined(_MSC_VER) || defined(_DEBUG))
  warn(
      "compiled without optimisation, a tick takes 70 times as long: use -O2, in CMake CMAKE_BUILD_TYPE=Release, or "
      "the compiled library");
#endif
  if (device.output_dof < 3) warn("device '", device.name, "' gives no force: the scene will not be felt");
  if (device.input_dof < 6) warn("device '", device.name, "' reads no rotation: the tool does not rotate");
  if constexpr (requires { Scene::kHasTorque; }) {
    if (Scene::kHasTorque && device.output_dof >= 3 && device.output_dof < 6)
      warn("the scene computes torque but device '", device.name, "' has ", device.output_dof,
           " output degrees of freedom: torque is dropped");
    if (!Scene::kHasTorque && device.output_dof >= 6)
      warn("the scene computes no torque: device '", device.name, "', which could render it, gives force alone");
  }
  if constexpr (requires {
                  { scene.stiffness() } -> std::convertible_to<double>;
                }) {
    double stiffness = static_cast<double>(scene.stiffness());
    std::string where;
    // A stiffening law reaches its largest tangent stiffness at the device's largest force.
    if constexpr (requires { scene.tangent_stiffness(1.0); }) {
      stiffness = static_cast<double>(scene.tangent_stiffness(device.max_force));
      where = ", as a tangent";
    }
    const double at_device = registration.device_stiffness(stiffness);
    if (device.stiffness > 0 && at_device > device.stiffness)
      warn("the felt stiffness is ", at_device, " N/m (scale ", registration.scale(), where, "), more than the ",
           device.stiffness, " N/m that device '", device.name, "' renders stably");
  }
  if (device.rate > 0 && rate < 0.5 * device.rate)
    warn("the loop runs at ", rate, " Hz, less than half the ", device.rate, " Hz that device '", device.name,
         "' is made for");
  return warnings;
}

/// Limits a wrench (about H, D axes) to the device's range. Drops torque or force if the device has no such axes, and
/// shortens force and torque to their maxima, direction kept. Returns true if a vector was shortened; dropping does not
/// count.
inline bool limit_to(const DeviceCapabilities& device, Wrenchd& wrench_H_D) noexcept {
  if (device.output_dof < 6) wrench_H_D.torque.setZero();
  if (device.output_dof < 3) wrench_H_D.force.setZero();
  const auto shorten = [](Vec3d& v, double limit) noexcept {
    const double norm = std::hypot(v.x(), v.y(), v.z());
    if (!(limit > 0) || !(norm > limit)) return false;
    v *= limit / norm;
    return true;
  };
  const bool force = shorten(wrench_H_D.force, device.max_force);
  const bool torque = shorten(wrench_H_D.torque, device.max_torque);
  return force || torque;
}

}  // namespace trephine
