// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// Outcome of a tick, ordered by severity but for the last. A tick reports the most severe outcome that applies, and
/// `kFarAway` where no other does.
enum class Status : std::uint8_t {
  kOk = 0,
  kWorkBound = 1,      ///< the work limit ended a search early; the next tick continues it
  kStartedInside = 2,  ///< tool and bone overlapped at a start or a restore
  kJump = 3,           ///< tool or bone moved farther in a tick than a hand moves it: nothing was cut
  kBadInput = 4,       ///< pose non-finite, out of range or no rotation: zero wrench, state kept
  kNonFinite = 5,      ///< a law overflowed: zero wrench, contact was reset
  kFarAway = 6,        ///< the tool stays farther from the bone than a hand works: are poses in metres?
};

/// The more severe of two outcomes.
[[nodiscard]] constexpr Status worse(Status a, Status b) noexcept { return a < b ? b : a; }

/// Name of the outcome in snake_case, for logs.
[[nodiscard]] constexpr const char* to_string(Status s) noexcept {
  switch (s) {
    case Status::kOk:
      return "ok";
    case Status::kWorkBound:
      return "work_bound";
    case Status::kStartedInside:
      return "started_inside";
    case Status::kJump:
      return "jump";
    case Status::kBadInput:
      return "bad_input";
    case Status::kNonFinite:
      return "non_finite";
    case Status::kFarAway:
      return "far_away";
  }
  return "unknown";
}

/// True if the servo loop must ramp the wrench up from zero instead of applying it at once, unless the scene bounds its
/// wrench (`HapticScene::bounds_wrench`).
[[nodiscard]] constexpr bool needs_ramp(Status s) noexcept { return s >= Status::kStartedInside; }

}  // namespace trephine
