// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

/// The same work as compiled with -O2 and with -O3 (levels.cpp, built twice).
namespace speed_levels {

using Work = std::vector<std::pair<std::string, std::function<void()>>>;

/// 256 x 256 x 176 voxels of flat bone below `level` voxels, whose surface two voxels blur.
[[nodiscard]] inline std::vector<std::uint8_t> flat_voxels(int level) {
  std::vector<std::uint8_t> voxels;
  for (int k = 0; k < 176; ++k)
    voxels.insert(voxels.end(), 256 * 256, static_cast<std::uint8_t>(std::clamp(127 + 64 * (level - k), 0, 255)));
  return voxels;
}

/// Batched sampling, a tick that touches nothing, one of many vertices in bone.
[[nodiscard]] Work work_at_o2();
[[nodiscard]] Work work_at_o3();

}  // namespace speed_levels
