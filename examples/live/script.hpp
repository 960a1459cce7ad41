// SPDX-License-Identifier: MIT
#pragma once

#include "keys.hpp"
#include "mouse_hand.hpp"
#include "protection.hpp"

#include <fstream>
#include <optional>
#include <string>
#include <vector>

namespace live {

/// One line of a session's file: what happens, and when [s since the start].
struct Event {
  enum class Kind {
    kHand,     ///< the hand's wish is `pose`
    kSpindle,  ///< `on`
    kView,     ///< the camera is `camera`
    kKey,      ///< `action`
    kPush,     ///< push by numbers[0] [mm] along the view
    kMove,     ///< the mouse is at pixel numbers[0], numbers[1]
    kTurn,     ///< the mouse turned the drill by numbers[0], numbers[1] [pixels]
    kProtect,  ///< structures by `protection`
    kTool,     ///< the tool named `file`, or the burr
    kOrbit,    ///< from now on the view turns by numbers[0] [degrees/s]
    kSize,     ///< the window is numbers[0] x numbers[1] [pixels]
    kLog,      ///< print a line about structures
    kShot,     ///< save a screenshot to `file`
    kQuit,
  };
  double time = 0;
  Kind kind = Kind::kQuit;
  Posed pose = Posed::Identity();
  OrbitCamera camera{};
  bool on = false;
  Action action = Action::kNone;
  Protection protection = Protection::kOff;
  std::array<double, 2> numbers{};
  std::string file;
};

/// Reads a session's file, a line an event, `#` before a comment:
///
///     TIME hand X Y Z QW QX QY QZ     the hand's wish, mm in W
///     TIME spindle on|off
///     TIME view X Y Z YAW PITCH DISTANCE   focus [mm in W], degrees, mm
///     TIME key NAME                   a key by the name that the help shows
///     TIME protect off|warn|push|veto
///     TIME tool NAME                  as match-head-3, or burr
///     TIME push MM | move PX PY | turn PX PY   as the mouse does
///     TIME orbit DEGREES_A_SECOND
///     TIME size WIDTH HEIGHT
///     TIME log                        prints what the drill did to structures since the last `restore`
///     TIME shot FILE
///     TIME quit
///
/// Throws std::runtime_error with file, line and reason. Times must not fall.
[[nodiscard]] std::vector<Event> read_events(const std::string& path);

/// Writes a session's file as it goes: hand and view 30 times a second where they changed, keys, spindle,
/// protection and tool at once.
class EventWriter {
 public:
  /// Throws std::runtime_error where the file cannot be written.
  explicit EventWriter(const std::string& path);
  void hand(double time, const Posed& X_WT);
  void view(double time, const OrbitCamera& camera);
  void spindle(double time, bool on);
  void protect(double time, Protection protection);
  void tool(double time, const std::string& name);
  void key(double time, Action action);

 private:
  static constexpr double kInterval = 1.0 / 30;  // [s]
  std::ofstream out_;
  double last_hand_ = -1, last_view_ = -1;
  std::string hand_text_, view_text_;
};

}  // namespace live
