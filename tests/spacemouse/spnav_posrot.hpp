// SPDX-License-Identifier: MIT
#pragma once

#include "motion_events.hpp"

#include <array>
#include <span>

/// libspnav's own way of moving an object by events, behind a header without X11's macros.
namespace spacemouse::test {

struct PosRot {
  std::array<double, 3> position;    ///< a thousandth of a unit per count
  std::array<double, 4> quaternion;  ///< x, y, z, w; a thousandth of a radian per count
};

[[nodiscard]] PosRot moved_by_libspnav(std::span<const Deflection> events);

}  // namespace spacemouse::test
