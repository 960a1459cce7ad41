// SPDX-License-Identifier: MIT
#include "device_setup.hpp"

namespace openhaptics {

std::string set_up_devices(const std::function<trephine::HandTarget(double)>&) {
  return "OpenHaptics HD: button 1 turns the spindle, button 2 is the clutch";
}

}  // namespace openhaptics
