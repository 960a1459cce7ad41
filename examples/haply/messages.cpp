// SPDX-License-Identifier: MIT
#include "messages.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <charconv>
#include <cmath>

namespace haply {
namespace {

using Json = nlohmann::json;
using trephine::Quatd;
using trephine::Vec3d;

constexpr double kReach = 1.0;   // [m] thrice the arm's: a workspace may be moved, hardly scaled
constexpr double kSpeed = 10.0;  // [m/s] a hand with a stylus reaches 3
constexpr double kUnit = 0.02;   // of a quaternion's norm; services round to 2^-14

/// The parsed text; discarded where it is no JSON or too long. Nesting costs the parser no stack.
Json parsed(std::string_view message) {
  if (message.size() > kMessageLimit) return Json(Json::value_t::discarded);
  return Json::parse(message, nullptr, false);
}

/// The member of an object, or null.
const Json& member(const Json& object, const char* name) {
  static const Json none;
  if (!object.is_object()) return none;
  const auto found = object.find(name);
  return found == object.end() ? none : *found;
}

bool number(const Json& value, double& out) {
  if (!value.is_number()) return false;
  out = value.get<double>();
  return std::isfinite(out);
}

bool vector(const Json& value, Vec3d& out) {
  return number(member(value, "x"), out.x()) && number(member(value, "y"), out.y()) &&
         number(member(value, "z"), out.z());
}

bool is(const Json& value, bool expected) { return value.is_boolean() && value.get<bool>() == expected; }

std::string id_of(const Json& device) {
  const Json& id = member(device, "device_id");
  return id.is_string() ? id.get<std::string>() : std::string();
}

/// The device of a list by its identifier, or null; `id` empty: the first that has one.
const Json& device_in(const Json& list, const std::string& id) {
  static const Json none;
  if (!list.is_array()) return none;
  for (const Json& device : list) {
    const std::string found = id_of(device);
    if (!found.empty() && (id.empty() || found == id)) return device;
  }
  return none;
}

Trouble read_handle(const Json& handle, Reading& reading) {
  const Json& state = member(handle, "state");
  const Json& status = member(handle, "status");
  if (is(member(status, "connected"), false) || is(member(status, "awake"), false)) return Trouble::kHandle;
  const Json& orientation = member(state, "orientation");
  Vec3d axis;
  double w = 0;
  if (!vector(orientation, axis) || !number(member(orientation, "w"), w)) return Trouble::kHandle;
  const Quatd q(w, axis.x(), axis.y(), axis.z());
  if (!(std::abs(q.norm() - 1) <= kUnit)) return Trouble::kHandle;
  reading.rotation = q.normalized();
  const Json& buttons = member(state, "buttons");
  reading.buttons = 0;
  if (is(member(state, "button"), true) || is(member(buttons, "a"), true)) reading.buttons |= 1U;
  if (is(member(buttons, "b"), true)) reading.buttons |= 2U;
  if (is(member(buttons, "c"), true)) reading.buttons |= 4U;
  return Trouble::kNone;
}

}  // namespace

Trouble parse_inventory(std::string_view message, const std::string& wanted, Inventory& inventory) {
  const Json all = parsed(message);
  if (!all.is_object() || !member(all, "inverse3").is_array()) return Trouble::kMessage;
  const Json& device = device_in(member(all, "inverse3"), wanted);
  if (device.is_null()) return Trouble::kTooFewDevices;
  inventory = {};
  inventory.device_id = id_of(device);
  const Json& type = member(member(device, "config"), "type");
  inventory.product_name = type.is_string() ? type.get<std::string>() : "inverse3";
  inventory.force_key = member(all, "session_id").is_null() ? "values" : "vector";
  for (const char* kind : {"wireless_verse_grip", "verse_grip", "custom_verse_grip"}) {
    inventory.handle_id = id_of(device_in(member(all, kind), {}));
    inventory.handle_kind = kind;
    if (!inventory.handle_id.empty()) break;
  }
  return Trouble::kNone;
}

Trouble parse_state(std::string_view message, const Inventory& inventory, Reading& reading) {
  const Json all = parsed(message);
  if (!all.is_object()) return Trouble::kMessage;
  const Json& device = device_in(member(all, "inverse3"), inventory.device_id);
  if (device.is_null()) return Trouble::kTooFewDevices;
  const Json& status = member(device, "status");
  for (const char* name : {"ready", "calibrated", "power_supply"})
    if (is(member(status, name), false)) return Trouble::kNotReady;
  Reading found;
  const Json& state = member(device, "state");
  if (!vector(member(state, "cursor_position"), found.position) ||
      !vector(member(state, "cursor_velocity"), found.velocity))
    return Trouble::kMessage;
  if (!(found.position.norm() <= kReach) || !(found.velocity.norm() <= kSpeed)) return Trouble::kRange;
  if (!inventory.handle_id.empty()) {
    const Json& handle = device_in(member(all, inventory.handle_kind.c_str()), inventory.handle_id);
    const Trouble trouble = read_handle(handle, found);
    if (trouble != Trouble::kNone) return trouble;
  }
  reading = found;
  return Trouble::kNone;
}

void write_force(const Inventory& inventory, const Vec3d& force, std::string& message) {
  const auto append = [&message](const char* name, double value) {
    std::array<char, 32> digits{};
    // Micronewtons, fixed: no exponent for a service to stumble over.
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed, 6);
    message.append(name).append(digits.data(), end.ptr);
  };
  message.assign(R"({"inverse3":[{"device_id":)").append(Json(inventory.device_id).dump());
  message.append(R"(,"commands":{"set_cursor_force":{")").append(inventory.force_key);
  append(R"(":{"x":)", force.x());
  append(R"(,"y":)", force.y());
  append(R"(,"z":)", force.z());
  message.append("}}}}]}");
}

Command parse_command(std::string_view message, const std::string& device_id) {
  const Json all = parsed(message);
  const Json& device = device_in(member(all, "inverse3"), device_id);
  const Json& set = member(member(device, "commands"), "set_cursor_force");
  Command command;
  const Json& newer = member(set, "vector");
  command.has_force = vector(newer.is_null() ? member(set, "values") : newer, command.force);
  return command;
}

}  // namespace haply
