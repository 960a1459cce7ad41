// SPDX-License-Identifier: MIT
#pragma once

#include "crtk.hpp"

#include <trephine/core/finite.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

/// Reports and commands as JSON, one object a datagram. Each message that is read is checked for size, type and range.
namespace robots {

inline constexpr std::size_t kLargestMessage = 1024;  // [bytes]; a report takes about 300, a command 500
inline constexpr double kFarthest = 10;               // [m] of a position from the base
inline constexpr double kLargestForce = 1000;         // [N]
inline constexpr double kLargestTorque = 100;         // [N·m]
inline constexpr double kLargestSpeed = 100;          // [m/s, rad/s]
inline constexpr double kLatestStamp = 1e12;          // [s]
inline constexpr double kQuaternionTolerance = 1e-3;  // of the length

namespace detail {

using Json = nlohmann::json;

[[noreturn]] inline void refuse_message(const char* name, const char* why) {
  std::string text(name);
  text.append(" ").append(why);
  throw std::invalid_argument(text);
}

[[nodiscard]] inline const Json& member(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) refuse_message(name, "is missing");
  return *found;
}
[[nodiscard]] inline double number(const Json& value, const char* name, double limit) {
  if (!value.is_number()) refuse_message(name, "is not of numbers");
  const double v = value.get<double>();
  if (!trephine::is_finite(v) || !(std::abs(v) <= limit)) refuse_message(name, "is out of range");
  return v;
}
template <std::size_t N>
void read(const Json& object, const char* name, double limit, std::array<double, N>& out) {
  const Json& list = member(object, name);
  if (!list.is_array() || list.size() != N) refuse_message(name, N == 3 ? "is not a list of 3" : "is not a list of 4");
  std::transform(list.begin(), list.end(), out.begin(), [&](const Json& v) { return number(v, name, limit); });
}
[[nodiscard]] inline std::uint64_t count(const Json& object, const char* name) {
  const Json& value = member(object, name);
  constexpr std::uint64_t kMost = std::uint64_t{1} << 53;  // a double holds it
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMost)
    refuse_message(name, "is not a whole number from 0 to 2^53");
  return value.get<std::uint64_t>();
}
[[nodiscard]] inline bool flag(const Json& object, const char* name) {
  const Json& value = member(object, name);
  if (!value.is_boolean()) refuse_message(name, "is not true or false");
  return value.get<bool>();
}
[[nodiscard]] inline double stamp(const Json& object) {
  const double v = number(member(object, "stamp"), "stamp", kLatestStamp);
  if (v < 0) refuse_message("stamp", "is out of range");
  return v;
}
[[nodiscard]] inline OperatingState state(const Json& object) {
  const Json& value = member(object, "operating_state");
  for (std::size_t s = 0; s < kStateNames.size(); ++s)
    if (value == kStateNames[s]) return static_cast<OperatingState>(s);
  refuse_message("operating_state", "is none of CRTK's");
}
inline void read(const Json& object, const char* name, CartesianPosition& out) {
  const Json& p = member(object, name);
  read(p, "position", kFarthest, out.position);
  read(p, "orientation", 2, out.orientation);
  const auto& q = out.orientation;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1) <= kQuaternionTolerance)) refuse_message("orientation", "is not of length 1");
}
inline void read(const Json& object, const char* name, CartesianForce& out) {
  const Json& f = member(object, name);
  read(f, "force", kLargestForce, out.force);
  read(f, "torque", kLargestTorque, out.torque);
}
[[nodiscard]] inline Json parsed(std::string_view text) {
  if (text.size() > kLargestMessage) refuse_message("the message", "is longer than 1024 bytes");
  Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (!json.is_object()) refuse_message("the message", "is not a JSON object");
  return json;
}

}  // namespace detail

/// Reads a report. Throws std::invalid_argument with a sentence for anything else.
[[nodiscard]] inline Report read_report(std::string_view text) {
  const detail::Json json = detail::parsed(text);
  Report r;
  r.sequence = detail::count(json, "sequence");
  r.stamp = detail::stamp(json);
  r.operating_state = detail::state(json);
  detail::read(json, "measured_cp", r.measured_cp);
  detail::read(json, "measured_cf", r.measured_cf);
  r.spindle = detail::flag(json, "spindle");
  return r;
}

/// Reads a command, likewise.
[[nodiscard]] inline Command read_command(std::string_view text) {
  const detail::Json json = detail::parsed(text);
  Command c;
  c.sequence = detail::count(json, "sequence");
  c.answers = detail::count(json, "answers");
  c.stamp = detail::stamp(json);
  c.operating_state = detail::state(json);
  detail::read(json, "servo_cp", c.servo_cp);
  const detail::Json& v = detail::member(json, "servo_cv");
  detail::read(v, "linear", kLargestSpeed, c.servo_cv.linear);
  detail::read(v, "angular", kLargestSpeed, c.servo_cv.angular);
  detail::read(json, "servo_cf", c.servo_cf);
  c.distance = detail::number(detail::member(json, "distance"), "distance", 1e3);
  c.limited = detail::flag(json, "limited");
  const detail::Json& reason = detail::member(json, "reason");
  if (!reason.is_string()) detail::refuse_message("reason", "is no text");
  c.reason = reason.get<std::string>();
  return c;
}

[[nodiscard]] inline std::string to_json(const Report& r) {
  return detail::Json{
      {"sequence", r.sequence},
      {"stamp", r.stamp},
      {"operating_state", to_string(r.operating_state)},
      {"measured_cp", {{"position", r.measured_cp.position}, {"orientation", r.measured_cp.orientation}}},
      {"measured_cf", {{"force", r.measured_cf.force}, {"torque", r.measured_cf.torque}}},
      {"spindle", r.spindle}}
      .dump();
}
[[nodiscard]] inline std::string to_json(const Command& c) {
  return detail::Json{{"sequence", c.sequence},
                      {"answers", c.answers},
                      {"stamp", c.stamp},
                      {"operating_state", to_string(c.operating_state)},
                      {"servo_cp", {{"position", c.servo_cp.position}, {"orientation", c.servo_cp.orientation}}},
                      {"servo_cv", {{"linear", c.servo_cv.linear}, {"angular", c.servo_cv.angular}}},
                      {"servo_cf", {{"force", c.servo_cf.force}, {"torque", c.servo_cf.torque}}},
                      {"distance", c.distance},
                      {"limited", c.limited},
                      {"reason", c.reason}}
      .dump();
}

}  // namespace robots
