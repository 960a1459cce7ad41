// SPDX-License-Identifier: MIT
#pragma once

#include "keys.hpp"
#include "mouse_hand.hpp"
#include "protection.hpp"

#include <array>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
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

  /// True for what ends a session: `quit`, and the key that does.
  [[nodiscard]] bool ends() const { return kind == Kind::kQuit || (kind == Kind::kKey && action == Action::kQuit); }
};

/// A word of sessions' files, what follows it, and the line that the help shows for it.
struct Command {
  std::string_view word;
  std::string_view arguments;
  std::string_view help;
  Event::Kind kind;
  bool (*read)(std::istream& in, Event& e);  ///< takes the arguments; false where they are not as they should be
};
/// The only list of commands: the reader, `--help` and the documents' test use it.
[[nodiscard]] std::span<const Command> commands();

/// Reads a session, a line an event: a time [s], a command, its arguments; `#` before a comment. Throws
/// std::runtime_error with its name, line and reason. Times must not fall.
[[nodiscard]] std::vector<Event> read_events(std::istream& in, const std::string& name);
/// Reads a session's file likewise.
[[nodiscard]] std::vector<Event> read_events(const std::string& path);

/// A session's events as time goes on. The end of a script is the program's; at that of a replay the hand takes over,
/// whatever ended the session that was recorded.
class Playback {
 public:
  enum class End { kProgram, kHand };
  Playback(std::vector<Event> events, End end) : events_(std::move(events)), end_(end) {}

  /// Hands on the events that are due at `time` [s], up to one that ends the session. False where the program ends.
  template <class Do>
  [[nodiscard]] bool play(double time, Do&& act) {
    for (; !is_over() && events_[next_].time <= time; ++next_) {
      if (events_[next_].ends()) {
        next_ = events_.size();
        break;
      }
      act(events_[next_]);
    }
    return !is_over() || end_ == End::kHand;
  }
  [[nodiscard]] bool is_over() const { return next_ >= events_.size(); }

 private:
  std::vector<Event> events_;
  End end_;
  std::size_t next_ = 0;
};

/// Writes a session as it goes: hand and view 30 times a second where they changed, keys, spindle,
/// protection and tool at once.
class EventWriter {
 public:
  /// `out` must outlive it.
  explicit EventWriter(std::ostream& out);
  void hand(double time, const Posed& X_WT);
  void view(double time, const OrbitCamera& camera);
  void spindle(double time, bool on);
  void protect(double time, Protection protection);
  void tool(double time, const std::string& name);
  /// The key that ends the session is left to `quit`.
  void key(double time, Action action);
  /// The session is over.
  void quit(double time);

 private:
  static constexpr double kInterval = 1.0 / 30;  // [s]
  std::ostream& out_;
  double last_hand_ = -1, last_view_ = -1;
  std::string hand_text_, view_text_;
};

}  // namespace live
