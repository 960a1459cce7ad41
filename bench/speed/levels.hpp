// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

/// The same work as compiled with -O2 and with -O3 (levels.cpp, built twice).
namespace speed_levels {

using Work = std::vector<std::pair<std::string, std::function<void()>>>;

/// Batched sampling, a tick that touches nothing, one of many vertices in bone.
[[nodiscard]] Work work_at_o2();
[[nodiscard]] Work work_at_o3();

}  // namespace speed_levels
