// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/simulated_device.hpp>

#include <functional>
#include <string>

namespace openhaptics {

/// What has to be done before a device is opened: with the stand-in, to plug in devices held by `hand` (targets in D);
/// with the SDK, nothing. Returns what the user should know about it.
[[nodiscard]] std::string set_up_devices(const std::function<trephine::HandTarget(double)>& hand);

}  // namespace openhaptics
