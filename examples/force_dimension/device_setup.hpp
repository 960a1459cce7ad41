// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace force_dimension {

/// Does what has to be done before a device is opened: with the stand-in, it plugs in one of each model, held by a
/// hand; with the SDK, nothing. Returns what the user should know about it.
[[nodiscard]] std::string set_up_devices();

}  // namespace force_dimension
