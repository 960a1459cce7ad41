// SPDX-License-Identifier: MIT
#pragma once

#include "force_dimension_errors.hpp"

#include <trephine/device/device.hpp>

#include <dhdc.h>
#include <drdc.h>

#include <stdexcept>
#include <string>

/// Which devices there are, and what each can do. Not affiliated with Force Dimension.
namespace force_dimension {

/// Returns an open device's model, with the hand that its wrist is for: "sigma.7", "lambda.7 left".
[[nodiscard]] inline std::string full_name(char id) {
  const char* model = dhdGetSystemName(id);
  return std::string(model != nullptr ? model : "Force Dimension device") + (dhdIsLeftHanded(id) ? " left" : "");
}

/// Opens the device of this name, or the first that opens, and returns its ID. Opening is the only way to learn a name.
/// Throws std::runtime_error: what, and what to do.
[[nodiscard]] inline char open_device(const std::string& name) {
  std::string seen, why = describe(DHD_ERROR_NO_DEVICE_FOUND);
  for (int i = 0; i < dhdGetDeviceCount(); ++i) {
    const int opened = drdOpenID(static_cast<char>(i));
    if (opened < 0) {
      why = describe(dhdErrorGetLast());
      continue;
    }
    const char id = static_cast<char>(opened);
    const std::string found = full_name(id);
    if (name.empty() || name == found) return id;
    seen += (seen.empty() ? "; there is " : ", ") + found;
    (void)drdClose(id);
  }
  throw std::runtime_error("cannot open " + (name.empty() ? "a device" : "device '" + name + "'") +
                           (seen.empty() ? ": " + why : seen));
}

/// Returns an open device's capabilities. Maxima are by family, as CHAI3D publishes them; a lambda, and models to come,
/// get cautious ones.
[[nodiscard]] inline trephine::DeviceCapabilities capabilities_of(char id) {
  trephine::DeviceCapabilities c{.name = full_name(id),
                                 .input_dof = dhdHasWrist(id) ? 6 : 3,
                                 .output_dof = dhdHasActiveWrist(id) ? 6 : 3,
                                 .max_force = 8,
                                 .stiffness = 2000,
                                 .rate = 1000};
  const auto is = [&](const char* family) { return c.name.find(family) != std::string::npos; };
  if (is("omega") || is("sigma")) c.max_force = 12;
  if (is("delta")) c.max_force = 20;
  if (is("omega") || is("delta")) c.stiffness = 5000;
  if (is("sigma")) c.stiffness = 4000;
  if (is("Falcon")) c.stiffness = 3000;
  if (c.output_dof == 6) {
    c.max_torque = is("sigma") ? 0.2 : 0.1;
    c.angular_stiffness = is("sigma") ? 1.0 : 0.5;
  }
  return c;
}

}  // namespace force_dimension
