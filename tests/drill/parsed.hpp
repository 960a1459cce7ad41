// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"

#include <vector>

/// Options as the program takes these arguments.
[[nodiscard]] inline drill::Options parsed(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "drill");
  return drill::parse_options(static_cast<int>(arguments.size()), arguments.data());
}
