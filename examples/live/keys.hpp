// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string_view>

namespace live {

/// What a key does.
enum class Action {
  kNone,
  kHelp,
  kSpindle,
  kRenderer,
  kLaw,
  kSmallerBurr,
  kLargerBurr,
  kRestore,
  kUndo,
  kClip,
  kProtection,
  kMarks,
  kPanels,
  kPlace,
  kHome,
  kShot,
  kCloser,
  kFarther,
  kQuit,
};

/// One key, its name in scripts, and the line that F1 shows for it.
struct Key {
  int code;  ///< GLFW's
  std::string_view name;
  Action action;
  std::string_view help;
};

/// The only list of keys: the window, the help and scripts read it.
inline constexpr std::array kKeys{
    Key{290, "F1", Action::kHelp, "shows or hides this help"},
    Key{32, "Space", Action::kSpindle, "starts or stops the spindle"},
    Key{82, "R", Action::kRenderer, "next renderer: coupled, line, surface"},
    Key{76, "L", Action::kLaw, "cutting forces on or off (coupled)"},
    Key{91, "[", Action::kSmallerBurr, "smaller burr or tool"},
    Key{93, "]", Action::kLargerBurr, "larger burr or tool"},
    Key{84, "T", Action::kPlace, "takes the drill to the bone under the mouse"},
    Key{72, "H", Action::kHome, "takes drill and view back to the start"},
    Key{85, "U", Action::kUndo, "undoes the last stroke"},
    Key{259, "Backspace", Action::kRestore, "puts the whole bone back"},
    Key{67, "C", Action::kClip, "cuts the picture open at the drill, or closes it"},
    Key{71, "G", Action::kProtection, "protects structures: off, warn, push, veto"},
    Key{77, "M", Action::kMarks, "shows or hides contacts and force"},
    Key{80, "P", Action::kPanels, "shows or hides the instruments"},
    Key{61, "+", Action::kCloser, "brings the view closer"},
    Key{45, "-", Action::kFarther, "takes the view farther away"},
    Key{301, "F12", Action::kShot, "saves a screenshot"},
    Key{256, "Escape", Action::kQuit, "closes a list or this help, else ends the program"},
};

/// What the mouse does, for the help.
struct MouseHelp {
  std::string_view gesture, help;
};
inline constexpr std::array kMouseHelp{
    MouseHelp{"move", "moves the drill across the screen"},
    MouseHelp{"wheel", "pushes the drill in, or pulls it out"},
    MouseHelp{"right drag", "the same, finely"},
    MouseHelp{"left button", "turns the spindle while it is down"},
    MouseHelp{"Ctrl + move", "tilts the drill about its tip"},
    MouseHelp{"middle drag", "turns the view"},
    MouseHelp{"Shift + middle drag", "moves the view"},
    MouseHelp{"Shift + wheel", "brings the view closer"},
};

[[nodiscard]] constexpr Action action_of(int code) {
  for (const Key& k : kKeys)
    if (k.code == code) return k.action;
  return Action::kNone;
}
[[nodiscard]] constexpr Action action_named(std::string_view name) {
  for (const Key& k : kKeys)
    if (k.name == name) return k.action;
  return Action::kNone;
}

}  // namespace live
