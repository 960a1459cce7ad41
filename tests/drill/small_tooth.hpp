// SPDX-License-Identifier: MIT
#pragma once

#include "phantom.hpp"
#include "surgeon.hpp"

#include <cstdint>

namespace drill {

/// The tooth in voxels of 0.25 mm.
inline const Bone& small_tooth() {
  static const Bone bone = [] {
    Bone b{.name = "tooth",
           .unit = "levels",
           .grid = tooth_phantom<std::int16_t>({.size = {104, 104, 72}, .spacing = 0.25e-3}),
           .isovalue = PhantomDensities::kIsovalue,
           .burr = {},
           .notes = {}};
    b.burr = fitting_burr(b.grid, {});
    return b;
  }();
  return bone;
}

/// At a place on its crown.
inline Surgeon small_tooth_surgeon() { return {find_spot(small_tooth()), small_tooth().burr, {}}; }

}  // namespace drill
