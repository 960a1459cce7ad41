// SPDX-License-Identifier: MIT
#include "device_setup.hpp"

namespace force_dimension {

std::string set_up_devices() { return "Force Dimension SDK: the first button or the closed gripper turns the spindle"; }

}  // namespace force_dimension
