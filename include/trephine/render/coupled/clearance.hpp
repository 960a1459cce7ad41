// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Bound of the motion that a tool can make before it meets a free surface element, for conservative advancement. The
/// elements near the tool are listed (`ElementList`); the bound holds for listed and unlisted ones.
struct Clearance {
  double listed_distance = 0;  ///< least distance of the listed elements that are free [m]
  double listed_arm = 0;       ///< no listed element is farther than this from T's origin [m]
  ToolMotion unlisted_motion;  ///< motion that brings no unlisted element into contact
  double unlisted_arm = 1;     ///< no part of the tool that meets one is farther than this from T's origin [m]

  /// Largest fraction of a motion that brings no free element deeper into the tool than `depth` [m]. It may exceed 1.
  [[nodiscard]] double max_step_fraction(const ToolMotion& motion, double depth = 0) const noexcept {
    const auto ratio = [](double part, double whole) {
      return whole > 0 ? part / whole : std::numeric_limits<double>::infinity();
    };
    return std::min({ratio(listed_distance + depth, motion.at(listed_arm)),
                     ratio(unlisted_motion.shift + depth / 2, motion.shift),
                     ratio(unlisted_motion.turn + depth / 2 / unlisted_arm, motion.turn)});
  }
};

}  // namespace trephine
