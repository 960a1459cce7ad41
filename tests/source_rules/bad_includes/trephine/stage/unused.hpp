// SPDX-License-Identifier: MIT
#pragma once
#include <trephine/core/length.hpp>
#include <algorithm>
#include <optional>
struct Unused {  // of a Length or a std::optional only its comment speaks
  int least(int a, int b) { return std::min(a, b); }
};
