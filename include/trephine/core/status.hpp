// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace trephine {

/// What a tick has to say beside its wrench. Ordered by severity; a tick reports the most severe that applies.
enum class Status : std::uint8_t {
  kOk = 0,
  kWorkBound = 1,      ///< the work limit ended a search early; what is left is carried on at the next tick
  kStartedInside = 2,  ///< tool or bone appeared where the other is (start, restore): ramp the hand in
  kJump = 3,           ///< the pose moved farther in a tick than the search range; the contact state was started anew
  kBadInput = 4,       ///< non-finite or absurd pose or rotation: zero wrench, state kept
  kNonFinite = 5,      ///< a law gave a non-finite wrench (overflow): zero wrench, state started anew
};

[[nodiscard]] constexpr Status worse(Status a, Status b) noexcept { return a < b ? b : a; }

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
  }
  return "unknown";
}

/// True where the servo loop must bring the wrench back gently (a ramp) instead of at once.
[[nodiscard]] constexpr bool needs_ramp(Status s) noexcept { return s >= Status::kStartedInside; }

}  // namespace trephine
