// SPDX-License-Identifier: MIT
#include "spnav_posrot.hpp"

#include <spnav.h>

namespace spacemouse::test {

PosRot moved_by_libspnav(std::span<const Deflection> events) {
  spnav_posrot at{};
  spnav_posrot_init(&at);
  for (const Deflection& d : events) {
    spnav_event_motion m{};
    m.x = d.x;
    m.y = d.y;
    m.z = d.z;
    m.rx = d.rx;
    m.ry = d.ry;
    m.rz = d.rz;
    spnav_posrot_moveobj(&at, &m);
  }
  const auto wide = [](float v) { return static_cast<double>(v); };
  return {{wide(at.pos[0]), wide(at.pos[1]), wide(at.pos[2])},
          {wide(at.rot[0]), wide(at.rot[1]), wide(at.rot[2]), wide(at.rot[3])}};
}

}  // namespace spacemouse::test
