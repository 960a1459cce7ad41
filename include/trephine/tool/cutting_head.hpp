// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/outline.hpp>

#include <algorithm>

namespace trephine::inline TREPHINE_ALIGNED {

/// The part of a tool that cuts: an outline, enlarged by `allowance` [m] on all sides.
struct CuttingHead {
  ToolOutline outline;
  double allowance = 0;
  double guide = 0;  ///< height above the head to which the tool goes on as wide as its hole [m]

  /// The outline with the guide, or with so much of it [m].
  [[nodiscard]] ToolOutline with_guide(double height) const noexcept {
    return guide > 0 ? outline.raised(std::min(guide, height)) : outline;
  }
};

}  // namespace trephine
