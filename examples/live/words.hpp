// SPDX-License-Identifier: MIT
#pragma once

#include "workbench.hpp"

#include <array>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

/// What the instruments say, in the window and on the page.
namespace live {

/// The status in words for the one who drills.
[[nodiscard]] inline const char* in_words(trephine::Status s) {
  using trephine::Status;
  switch (s) {
    case Status::kOk:
      return "all well";
    case Status::kWorkBound:
      return "search cut short, goes on in the next tick";
    case Status::kStartedInside:
      return "drill starts in bone: force fades in";
    case Status::kJump:
      return "the hand jumped: nothing is cut, force fades in";
    case Status::kBadInput:
      return "the device's pose is no pose: no force";
    case Status::kNonFinite:
      return "force is not finite: none is sent";
    case Status::kFarAway:
      return "the drill is metres from the bone: are poses in metres?";
  }
  return "";
}

/// What of the drill touches bone.
[[nodiscard]] inline const char* touch_in_words(const TickView& v) {
  if (v.passes) return "passes through bone";
  return v.contact.tip && v.contact.shaft ? "tip and shaft touch"
         : v.contact.tip                  ? "tip touches"
         : v.contact.shaft                ? "shaft touches"
                                          : "in the air";
}

/// What to try next, `seconds` after the start, or nullptr.
[[nodiscard]] inline const char* hint_for(const Workbench& bench, double seconds) {
  const TickView& v = bench.view();
  if (v.passes) return "The drill is in bone, and passes through it. Pull it out with the wheel.";
  if (seconds < 6) return "Move the mouse to move the drill. The wheel pushes it in. F1 shows all keys.";
  if (v.removed_mm3 == 0 && !v.spindle_on && v.contact.count > 0)
    return "The drill touches bone. Hold the left button, or press Space, and push.";
  if (v.removed_mm3 == 0 && v.spindle_on && v.contact.count == 0) return "Push the drill into the bone with the wheel.";
  if (seconds < 14 && bench.guarded() != nullptr)
    return "G changes how structures are protected: off, warn, push, veto.";
  if (seconds < 90 && v.removed_mm3 > 5 && !v.spindle_on)
    return "C cuts the picture open, U undoes, the middle button turns the view.";
  return nullptr;
}

/// The title of the instruments: renderer and tool.
[[nodiscard]] inline std::string title_of(const DrillSettings& drill) {
  if (drill.shape() != nullptr) return std::string(to_string(drill.renderer)) + ", " + drill.tool_name + " mm";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%s, burr diameter %.1f mm", to_string(drill.renderer),
                2e3 * drill.burr.tip_radius);
  return text.data();
}

/// The status of a tick, or why there is no force.
[[nodiscard]] inline const char* state_in_words(const TickView& v) {
  return v.passes ? "no force, no cut until the drill is out of bone" : in_words(v.status);
}

/// True where the drill is nearer to a structure than it may, and protection is on.
[[nodiscard]] inline bool warns(Protection protection, const StructureReport& r) {
  return protection != Protection::kOff && r.in_margin;
}
/// How the drill lies to the structure nearest to it.
[[nodiscard]] inline const char* nearness_in_words(Protection protection, const StructureReport& r) {
  return !r.in_margin            ? "no structure is too near"
         : !warns(protection, r) ? "protection is off"
         : r.distance >= 0       ? "too near this structure"
                                 : "the drill is in this structure";
}

/// What the drill feels of soft structures, and what is torn; empty for nothing.
[[nodiscard]] inline std::string felt_in_words(const std::vector<trephine::Structure>& structures,
                                               const StructureReport& r) {
  const auto name = [&](int s) { return structures[static_cast<std::size_t>(s)].name; };
  std::string text;
  if (r.pressed >= 0) {
    std::array<char, 32> force{};
    std::snprintf(force.data(), force.size(), "%.2f N on the ", r.pressed_N);
    text = force.data() + name(r.pressed);
  }
  if (r.torn >= 0) text += r.torn == r.pressed ? ", torn" : (text.empty() ? "" : "; ") + name(r.torn) + " torn";
  return text;
}

}  // namespace live
