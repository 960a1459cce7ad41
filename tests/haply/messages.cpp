// SPDX-License-Identifier: MIT
// Every message is checked: only a whole, finite state of the session's own device gives a reading.
#include "messages.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "support/near.hpp"

namespace {

using namespace haply;
using trephine::Vec3d;
using trephine::test::within;

const std::string kArm = R"("device_id":"04EA","state":{"cursor_position":{"x":0.1,"y":-0.2,"z":0.15},)"
                         R"("cursor_velocity":{"x":0,"y":0,"z":-0.5}},"status":{"calibrated":true,"ready":true})";
const std::string kGrip = R"("device_id":"61576","state":{"orientation":{"w":0.5,"x":-0.5,"y":0.5,"z":0.5},)"
                          R"("buttons":{"a":true,"b":false,"c":true}},"status":{"connected":true,"awake":true})";

std::string message(const std::string& arm, const std::string& grip = kGrip) {
  return R"({"inverse3":[{)" + arm + R"(}],"wireless_verse_grip":[{)" + grip + R"(}],"verse_grip":[]})";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

Inventory inventory_of(const std::string& text) {
  Inventory inventory;
  REQUIRE(parse_inventory(text, "", inventory) == Trouble::kNone);
  return inventory;
}

}  // namespace

TEST_CASE("Haply messages: the inventory names devices, and the version by its session") {
  Inventory inventory = inventory_of(message(kArm));
  CHECK(inventory.device_id == "04EA");
  CHECK(inventory.handle_id == "61576");
  CHECK(inventory.handle_kind == "wireless_verse_grip");
  CHECK(inventory.force_key == "values");
  inventory = inventory_of(replaced(message(kArm), "{", R"({"session_id":7,)"));
  CHECK(inventory.force_key == "vector");
  inventory = inventory_of(R"({"inverse3":[{)" + kArm + "}]}");
  CHECK(inventory.handle_id.empty());
  CHECK(parse_inventory(message(kArm), "049D", inventory) == Trouble::kTooFewDevices);
  CHECK(parse_inventory(R"({"inverse3":[]})", "", inventory) == Trouble::kTooFewDevices);
  CHECK(parse_inventory(R"({"inverse3":[{"device_id":7}]})", "", inventory) == Trouble::kTooFewDevices);
  for (const char* text : {"", "[]", "null", "7", "{}", R"({"inverse3":{}})", "{\"inverse3\":[", "\xff\xfe"})
    CHECK(parse_inventory(text, "", inventory) == Trouble::kMessage);
}

TEST_CASE("Haply messages: a state gives position, velocity, rotation and buttons") {
  const Inventory inventory = inventory_of(message(kArm));
  Reading reading;
  REQUIRE(parse_state(message(kArm), inventory, reading) == Trouble::kNone);
  CHECK(reading.position == Vec3d(0.1, -0.2, 0.15));
  CHECK(reading.velocity == Vec3d(0, 0, -0.5));
  CHECK(reading.rotation.w() == within(0.5, 1e-12));
  CHECK(reading.rotation.x() == within(-0.5, 1e-12));
  CHECK(reading.buttons == 5);
  // A wired handle has one button, and its device stands in another list.
  const std::string wired = R"({"inverse3":[{)" + kArm +
                            R"(}],"verse_grip":[{"device_id":"7","state":{"button":true,)" +
                            R"("orientation":{"w":1,"x":0,"y":0,"z":0}}}]})";
  REQUIRE(parse_state(wired, inventory_of(wired), reading) == Trouble::kNone);
  CHECK(reading.buttons == 1);
}

TEST_CASE("Haply messages: whatever is not a state is refused, and the reading stays") {
  const Inventory inventory = inventory_of(message(kArm));
  struct Hostile {
    std::string text;
    Trouble trouble;
  };
  const std::string deep(30000, '[');
  const std::vector<Hostile> hostile = {
      {"", Trouble::kMessage},
      {"\0\0", Trouble::kMessage},
      {deep, Trouble::kMessage},
      {"{\"inverse3\":" + deep + std::string(30000, ']') + "}", Trouble::kTooFewDevices},
      {message(kArm).substr(0, 150), Trouble::kMessage},
      {message(kArm) + "x", Trouble::kMessage},
      {message(kArm) + std::string(kMessageLimit, ' '), Trouble::kMessage},
      {"[" + message(kArm) + "]", Trouble::kMessage},
      {R"({"inverse3":[]})", Trouble::kTooFewDevices},
      {R"({"inverse3":{"04EA":{)" + kArm + "}}}", Trouble::kTooFewDevices},
      {message(replaced(kArm, "04EA", "04EB")), Trouble::kTooFewDevices},
      {message(replaced(kArm, "0.15", "NaN")), Trouble::kMessage},
      {message(replaced(kArm, "0.15", "null")), Trouble::kMessage},
      {message(replaced(kArm, "0.15", "1e999")), Trouble::kMessage},
      {message(replaced(kArm, "0.15", "\"0.15\"")), Trouble::kMessage},
      {message(replaced(kArm, "0.15", "true")), Trouble::kMessage},
      {message(replaced(kArm, "\"z\":0.15", "\"w\":0.15")), Trouble::kMessage},
      {message(replaced(kArm, "cursor_velocity", "velocity")), Trouble::kMessage},
      {message(replaced(kArm, "0.15", "1.5")), Trouble::kRange},
      {message(replaced(kArm, "0.15", "1e300")), Trouble::kRange},
      {message(replaced(kArm, "-0.5", "-50")), Trouble::kRange},
      {message(replaced(kArm, "\"calibrated\":true", "\"calibrated\":false")), Trouble::kNotReady},
      {message(replaced(kArm, "\"ready\":true", "\"ready\":false")), Trouble::kNotReady},
      {message(kArm, replaced(kGrip, "\"connected\":true", "\"connected\":false")), Trouble::kHandle},
      {message(kArm, replaced(kGrip, "\"awake\":true", "\"awake\":false")), Trouble::kHandle},
      {message(kArm, replaced(kGrip, "61576", "61577")), Trouble::kHandle},
      {message(kArm, replaced(kGrip, "\"w\":0.5", "\"w\":0")), Trouble::kHandle},
      {message(kArm, replaced(kGrip, "\"w\":0.5", "\"w\":null")), Trouble::kHandle},
      {message(kArm, replaced(kGrip, "\"w\":0.5", "\"w\":5e200")), Trouble::kHandle},
      {R"({"inverse3":[{)" + kArm + "}]}", Trouble::kHandle},
  };
  for (const Hostile& h : hostile) {
    CAPTURE(h.text.substr(0, 300));
    Reading reading;
    reading.position = Vec3d(1, 2, 3);
    reading.buttons = 9;
    CHECK(parse_state(h.text, inventory, reading) == h.trouble);
    CHECK(reading.position == Vec3d(1, 2, 3));
    CHECK(reading.buttons == 9);
  }
}

TEST_CASE("Haply messages: a force is written as both versions want it, and read back") {
  for (const bool newer : {false, true}) {
    Inventory inventory{.device_id = "0\"4", .handle_id = {}, .handle_kind = {}, .force_key = {}, .product_name = {}};
    inventory.force_key = newer ? "vector" : "values";
    std::string text;
    write_force(inventory, Vec3d(1.25, -2e-7, -10), text);
    CAPTURE(text);
    CHECK(text.find(newer ? "\"vector\":{" : "\"values\":{") != std::string::npos);
    const Command command = parse_command(text, "0\"4");
    CHECK(command.has_force);
    CHECK((command.force - Vec3d(1.25, 0, -10)).norm() == within(0, 1e-6));
    CHECK_FALSE(parse_command(text, "04EA").has_force);
  }
  for (const char* text : {"", "{}", "[]", R"({"inverse3":[{"device_id":"04EA","commands":{"set_cursor_force":7}}]})"})
    CHECK_FALSE(parse_command(text, "04EA").has_force);
}
