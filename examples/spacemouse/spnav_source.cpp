// SPDX-License-Identifier: MIT
#include "spnav_source.hpp"

#include <sys/socket.h>

#include <cerrno>
#include <stdexcept>

#include <spnav.h>  // last: X11's macros come with it

namespace spacemouse {
namespace {

/// libspnav tells a closed connection and an empty one alike.
bool is_lost() noexcept {
  char byte = 0;
  const auto got = recv(spnav_fd(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
}

}  // namespace

SpnavSource::SpnavSource() {
  if (spnav_open() == -1)
    throw std::runtime_error(
        "spacemouse: no connection to the spacenav driver: install and start spacenavd, and plug the device in");
}

SpnavSource::~SpnavSource() { spnav_close(); }

Event SpnavSource::next() noexcept {
  spnav_event event{};
  switch (spnav_poll_event(&event)) {
    case SPNAV_EVENT_MOTION: {
      const spnav_event_motion& m = event.motion;
      return {.kind = Event::kMotion, .deflection = {m.x, m.y, m.z, m.rx, m.ry, m.rz}};
    }
    case SPNAV_EVENT_BUTTON:
      return {.kind = Event::kButton, .button = event.button.bnum, .pressed = event.button.press != 0};
    case 0:
      return {.kind = is_lost() ? Event::kLost : Event::kNone};
    default:  // devices come and go, settings change: a held deflection must not outlive its device
      return {.kind = Event::kMotion};
  }
}

}  // namespace spacemouse
