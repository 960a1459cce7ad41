// SPDX-License-Identifier: MIT
#include "script.hpp"

#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>
#include <sstream>
#include <stdexcept>

namespace live {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// Reads numbers of at most 1e6 millimetres, pixels or degrees. Some libraries also read `nan` and `inf` as numbers.
template <class... Number>
bool read_bounded(std::istream& in, Number&... numbers) {
  return ((in >> numbers && std::abs(numbers) <= 1e6) && ...);
}
bool read_hand(std::istream& in, Event& e) {
  Vec3d p;
  trephine::Quatd q;
  if (!read_bounded(in, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z())) return false;
  if (!(std::abs(q.norm() - 1) < 1e-3)) return false;
  e.pose = trephine::make_pose<double>(q.normalized().toRotationMatrix(), Vec3d(1e-3 * p));
  return true;
}
bool read_spindle(std::istream& in, Event& e) {
  std::string state;
  in >> state;
  e.on = state == "on";
  return state == "on" || state == "off";
}
bool read_view(std::istream& in, Event& e) {
  Vec3d p;
  double yaw = 0, pitch = 0, distance = 0;
  if (!read_bounded(in, p.x(), p.y(), p.z(), yaw, pitch, distance)) return false;
  e.camera = {.focus_W = 1e-3 * p, .yaw = yaw / kDegrees, .pitch = pitch / kDegrees, .distance = 1e-3 * distance};
  return std::abs(e.camera.pitch) <= OrbitCamera::kSteepest && e.camera.distance >= OrbitCamera::kNearest &&
         e.camera.distance <= OrbitCamera::kFarthest;
}
bool read_key(std::istream& in, Event& e) {
  std::string name;
  in >> name;
  e.action = action_named(name);
  return e.action != Action::kNone;
}
bool read_protection(std::istream& in, Event& e) {
  std::string name;
  in >> name;
  const auto at = std::find(kProtectionNames.begin(), kProtectionNames.end(), name);
  if (at == kProtectionNames.end()) return false;
  e.protection = kProtections[static_cast<std::size_t>(at - kProtectionNames.begin())];
  return true;
}
bool read_tool(std::istream& in, Event& e) {
  in >> e.file;
  if (e.file == "burr") return true;
  try {
    (void)trephine::tool_by_name(e.file);
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}
bool read_file(std::istream& in, Event& e) { return static_cast<bool>(in >> e.file); }
bool read_number(std::istream& in, Event& e) { return read_bounded(in, e.numbers[0]); }
bool read_numbers(std::istream& in, Event& e) { return read_bounded(in, e.numbers[0], e.numbers[1]); }
bool read_size(std::istream& in, Event& e) {
  return read_numbers(in, e) && e.numbers[0] >= 160 && e.numbers[1] >= 120 && e.numbers[0] <= 7680 &&
         e.numbers[1] <= 4320;
}
bool read_nothing(std::istream&, Event&) { return true; }

using Kind = Event::Kind;
constexpr std::array kCommands{
    Command{"hand", "X Y Z QW QX QY QZ", "moves the hand to a place [mm] and a direction", Kind::kHand, read_hand},
    Command{"push", "MM", "pushes the drill along the view, as the wheel does", Kind::kPush, read_number},
    Command{"move", "X Y", "moves the mouse to a pixel", Kind::kMove, read_numbers},
    Command{"turn", "DX DY", "tilts the drill, as Ctrl and a motion of the mouse do", Kind::kTurn, read_numbers},
    Command{"spindle", "on|off", "starts or stops the spindle", Kind::kSpindle, read_spindle},
    Command{"key", "NAME", "presses a key by the name in the list of keys", Kind::kKey, read_key},
    Command{"tool", "NAME", "takes a tool, as match-head-3, or the burr", Kind::kTool, read_tool},
    Command{"protect", "off|warn|push|veto", "protects structures", Kind::kProtect, read_protection},
    Command{"view", "X Y Z YAW PITCH DISTANCE", "looks at a place [mm, degrees, mm]", Kind::kView, read_view},
    Command{"orbit", "DEGREES", "turns the view by so much a second from now on", Kind::kOrbit, read_number},
    Command{"size", "WIDTH HEIGHT", "resizes the window [pixels]", Kind::kSize, read_size},
    Command{"shot", "FILE", "saves a screenshot", Kind::kShot, read_file},
    Command{"log", "", "prints what the drill did to structures", Kind::kLog, read_nothing},
    Command{"quit", "", "ends the script, or gives a replay back to your hand", Kind::kQuit, read_nothing},
};

/// Reads what follows the time; false where it is not as it should be.
bool read_rest(std::istream& in, std::string_view word, Event& e) {
  const auto at = std::find_if(kCommands.begin(), kCommands.end(), [&](const Command& c) { return c.word == word; });
  if (at == kCommands.end()) return false;
  e.kind = at->kind;
  return at->read(in, e);
}

}  // namespace

std::span<const Command> commands() { return kCommands; }

std::vector<Event> read_events(std::istream& in, const std::string& name) {
  std::vector<Event> events;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line = line.substr(0, line.find('#'));
    std::istringstream words(line);
    std::string word, left;
    if (!(words >> word)) continue;
    Event e;
    std::istringstream time(word);
    const bool timed = static_cast<bool>(time >> e.time) && time.eof() && e.time >= 0 && std::isfinite(e.time);
    words >> word;
    if (!timed || !read_rest(words, word, e) || words >> left)
      throw std::runtime_error(name + ", line " + std::to_string(number) + ": not understood: " + line);
    if (!events.empty() && e.time < events.back().time)
      throw std::runtime_error(name + ", line " + std::to_string(number) + ": its time lies before the line above");
    events.push_back(std::move(e));
  }
  return events;
}

EventWriter::EventWriter(std::ostream& out) : out_(out) {
  out_ << "# A session of examples/live; --replay plays it.\n";
}

void EventWriter::hand(double time, const Posed& X_WT) {
  if (time - last_hand_ < kInterval) return;
  const trephine::Quatd q(X_WT.linear());
  const Vec3d p = 1e3 * X_WT.translation();
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "hand %.4f %.4f %.4f %.6f %.6f %.6f %.6f", p.x(), p.y(), p.z(), q.w(), q.x(),
                q.y(), q.z());
  if (hand_text_ == text.data()) return;
  hand_text_ = text.data();
  last_hand_ = time;
  out_ << time << ' ' << hand_text_ << '\n';
}

void EventWriter::view(double time, const OrbitCamera& c) {
  if (time - last_view_ < kInterval) return;
  const Vec3d p = 1e3 * c.focus_W;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "view %.3f %.3f %.3f %.3f %.3f %.3f", p.x(), p.y(), p.z(), kDegrees * c.yaw,
                kDegrees * c.pitch, 1e3 * c.distance);
  if (view_text_ == text.data()) return;
  view_text_ = text.data();
  last_view_ = time;
  out_ << time << ' ' << view_text_ << '\n';
}

void EventWriter::spindle(double time, bool on) {
  out_ << time << (on ? " spindle on\n" : " spindle off\n") << std::flush;
}

void EventWriter::protect(double time, Protection protection) {
  out_ << time << " protect " << to_string(protection) << '\n' << std::flush;
}

void EventWriter::tool(double time, const std::string& name) { out_ << time << " tool " << name << '\n' << std::flush; }

void EventWriter::quit(double time) { out_ << time << " quit\n" << std::flush; }

void EventWriter::key(double time, Action action) {
  if (action == Action::kQuit) return;
  for (const Key& k : kKeys)
    if (k.action == action) {
      out_ << time << " key " << k.name << '\n' << std::flush;
      return;
    }
}

}  // namespace live
