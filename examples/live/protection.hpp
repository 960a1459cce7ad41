// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace live {

/// What keeps the drill from structures; each adds to the one before.
enum class Protection : std::uint8_t {
  kOff,   ///< nothing; distances are shown
  kWarn,  ///< a warning within the margin
  kPush,  ///< a guard that pushes the drill out of the margin
  kVeto,  ///< no cut takes bone in or near a structure
};
inline constexpr std::array kProtections{Protection::kOff, Protection::kWarn, Protection::kPush, Protection::kVeto};

/// The names in scripts and on the command line, in the order of kProtections.
inline constexpr std::array<std::string_view, 4> kProtectionNames{"off", "warn", "push", "veto"};

[[nodiscard]] constexpr std::string_view to_string(Protection p) {
  return kProtectionNames[static_cast<std::size_t>(p)];
}
/// Returns the protection after `p`, and the first after the last.
[[nodiscard]] constexpr Protection next(Protection p) {
  return kProtections[(static_cast<std::size_t>(p) + 1) % kProtections.size()];
}

/// What a drill says of structures after a tick. Volumes are of whole voxels of bone, since the start or the last
/// `restore`.
struct StructureReport {
  int nearest = -1;     ///< number of the structure nearest to the whole tool; -1: none
  double distance = 0;  ///< from it, of the drawn tool, negative inside [m]
  bool in_margin = false;
  double push_N = 0;  ///< of the guard
  double refused_mm3 = 0, taken_mm3 = 0;
  int pressed = -1;      ///< number of the soft structure pressed with the greatest force; -1: none
  double pressed_N = 0;  ///< with that true force
  int torn = -1;         ///< number of a soft structure that is torn, of the pressed one first; -1: none
};

}  // namespace live
