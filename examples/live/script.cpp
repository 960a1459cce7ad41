// SPDX-License-Identifier: MIT
#include "script.hpp"

#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace live {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// Reads what follows the time; false where it is not as it should be.
bool read_rest(std::istringstream& in, const std::string& word, Event& e) {
  using Kind = Event::Kind;
  if (word == "hand") {
    e.kind = Kind::kHand;
    Vec3d p;
    trephine::Quatd q;
    if (!(in >> p.x() >> p.y() >> p.z() >> q.w() >> q.x() >> q.y() >> q.z())) return false;
    if (!p.allFinite() || !(std::abs(q.norm() - 1) < 1e-3)) return false;
    e.pose = trephine::make_pose<double>(q.normalized().toRotationMatrix(), Vec3d(1e-3 * p));
    return true;
  }
  if (word == "spindle") {
    e.kind = Kind::kSpindle;
    std::string state;
    in >> state;
    e.on = state == "on";
    return state == "on" || state == "off";
  }
  if (word == "protect") {
    e.kind = Kind::kProtect;
    std::string name;
    in >> name;
    const auto at = std::find(kProtectionNames.begin(), kProtectionNames.end(), name);
    if (at == kProtectionNames.end()) return false;
    e.protection = kProtections[static_cast<std::size_t>(at - kProtectionNames.begin())];
    return true;
  }
  if (word == "tool") {
    e.kind = Kind::kTool;
    in >> e.file;
    if (e.file == "burr") return true;
    try {
      (void)trephine::tool_by_name(e.file);
      return true;
    } catch (const std::invalid_argument&) {
      return false;
    }
  }
  if (word == "view") {
    e.kind = Kind::kView;
    Vec3d p;
    double yaw = 0, pitch = 0, distance = 0;
    if (!(in >> p.x() >> p.y() >> p.z() >> yaw >> pitch >> distance)) return false;
    e.camera = {.focus_W = 1e-3 * p, .yaw = yaw / kDegrees, .pitch = pitch / kDegrees, .distance = 1e-3 * distance};
    return p.allFinite() && std::abs(e.camera.pitch) <= OrbitCamera::kSteepest &&
           e.camera.distance >= OrbitCamera::kNearest && e.camera.distance <= OrbitCamera::kFarthest;
  }
  if (word == "key") {
    e.kind = Kind::kKey;
    std::string name;
    in >> name;
    e.action = action_named(name);
    return e.action != Action::kNone;
  }
  if (word == "shot") {
    e.kind = Kind::kShot;
    return static_cast<bool>(in >> e.file);
  }
  if (word == "log") {
    e.kind = Kind::kLog;
    return true;
  }
  if (word == "quit") {
    e.kind = Kind::kQuit;
    return true;
  }
  if (word == "push" || word == "orbit") {
    e.kind = word == "push" ? Kind::kPush : Kind::kOrbit;
    return static_cast<bool>(in >> e.numbers[0]);
  }
  if (word == "move" || word == "turn" || word == "size") {
    e.kind = word == "move" ? Kind::kMove : word == "turn" ? Kind::kTurn : Kind::kSize;
    if (!(in >> e.numbers[0] >> e.numbers[1])) return false;
    return e.kind != Kind::kSize ||
           (e.numbers[0] >= 160 && e.numbers[1] >= 120 && e.numbers[0] <= 7680 && e.numbers[1] <= 4320);
  }
  return false;
}

}  // namespace

std::vector<Event> read_events(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ": cannot be read");
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
      throw std::runtime_error(path + ", line " + std::to_string(number) + ": not understood: " + line);
    if (!events.empty() && e.time < events.back().time)
      throw std::runtime_error(path + ", line " + std::to_string(number) + ": its time lies before the line above");
    events.push_back(std::move(e));
  }
  return events;
}

EventWriter::EventWriter(const std::string& path) : out_(path) {
  if (!out_) throw std::runtime_error(path + ": cannot be written");
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

void EventWriter::key(double time, Action action) {
  for (const Key& k : kKeys)
    if (k.action == action) {
      out_ << time << " key " << k.name << '\n' << std::flush;
      return;
    }
}

}  // namespace live
