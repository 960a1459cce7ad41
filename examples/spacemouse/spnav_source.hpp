// SPDX-License-Identifier: MIT
#pragma once

#include "motion_events.hpp"

namespace spacemouse {

/// Events of the spacenav driver, through libspnav (Debian: libspnav-dev) and its own socket, not X11. libspnav keeps
/// one connection for the process, so there can be one of these at a time. Its header brings X11's macros (None,
/// Status, ...) along and is therefore included in the source file alone.
class SpnavSource {
 public:
  /// Throws std::runtime_error where the driver does not answer.
  SpnavSource();
  ~SpnavSource();
  SpnavSource(const SpnavSource&) = delete;
  SpnavSource& operator=(const SpnavSource&) = delete;

  /// Never waits; two system calls when there is no event.
  [[nodiscard]] Event next() noexcept;
};

static_assert(EventSource<SpnavSource>);

}  // namespace spacemouse
