// SPDX-License-Identifier: MIT
#include "messages.hpp"

#include "support/random.hpp"

#include <trephine/stage/motion.hpp>

#include <doctest/doctest.h>

#include <limits>
#include <string>
#include <vector>

using namespace robots;
using trephine::test::Random;

namespace {

Report some_report() {
  Report r;
  r.sequence = 7;
  r.stamp = 12.25;
  r.operating_state = OperatingState::kEnabled;
  r.measured_cp = {{0.1, -0.2, 0.3}, {0.5, -0.5, 0.5, 0.5}};
  r.measured_cf = {{1, 2, -3}, {0.1, 0.2, -0.3}};
  r.spindle = true;
  return r;
}

/// What is said of a text that is no report; empty if it is.
std::string fault(const std::string& text) {
  try {
    (void)read_report(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("Messages: what is written is read") {
  const Report r = some_report(), s = read_report(to_json(r));
  CHECK(to_json(s) == to_json(r));
  CHECK(s.measured_cp.position[1] == -0.2);
  CHECK(s.measured_cf.torque[2] == -0.3);
  CHECK(s.spindle);
  Command c;
  c.sequence = 3;
  c.answers = 7;
  c.operating_state = OperatingState::kEnabled;
  c.servo_cv.linear = {0.01, 0, -0.02};
  c.servo_cf.force = {0, 0, 4};
  c.distance = 1.0 / 3;
  c.limited = true;
  c.reason = "a reason";
  CHECK(to_json(read_command(to_json(c))) == to_json(c));
  CHECK(read_command(to_json(c)).distance == 1.0 / 3);
  CHECK(to_json(c).size() < kLargestMessage);
  const Posed X = pose(r.measured_cp);
  CHECK((X.matrix() - pose(position(X)).matrix()).norm() < 1e-15);
}

TEST_CASE("Messages: each fault of a report has its sentence") {
  const std::string good = to_json(some_report());
  REQUIRE(fault(good).empty());
  struct Case {
    const char *from, *to, *says;
  };
  const std::vector<Case> cases{
      {"{\"measured", "[{\"measured", "not a JSON object"},
      {"\"sequence\":7", "\"sequences\":7", "sequence is missing"},
      {"\"sequence\":7", "\"sequence\":-7", "sequence is not a whole number"},
      {"\"sequence\":7", "\"sequence\":7.5", "sequence is not a whole number"},
      {"\"sequence\":7", "\"sequence\":18446744073709551615", "sequence is not a whole number"},
      {"\"sequence\":7", "\"sequence\":\"7\"", "sequence is not a whole number"},
      {"12.25", "-1", "stamp is out of range"},
      {"12.25", "1e300", "stamp is out of range"},
      {"12.25", "1e999", "not a JSON object"},
      {"12.25", "NaN", "not a JSON object"},
      {"12.25", "null", "stamp is not of numbers"},
      {"\"ENABLED\"", "\"enabled\"", "operating_state is none"},
      {"\"ENABLED\"", "2", "operating_state is none"},
      {"[0.1,-0.2,0.3]", "[0.1,-0.2]", "position is not a list of 3"},
      {"[0.1,-0.2,0.3]", "[0.1,-0.2,0.3,0]", "position is not a list of 3"},
      {"[0.1,-0.2,0.3]", "{\"x\":1}", "position is not a list of 3"},
      {"[0.1,-0.2,0.3]", "[0.1,-0.2,[0.3]]", "position is not of numbers"},
      {"[0.1,-0.2,0.3]", "[0.1,-0.2,300]", "position is out of range"},
      {"0.5,-0.5,0.5,0.5", "0,0,0,0", "orientation is not of length 1"},
      {"0.5,-0.5,0.5,0.5", "0.5,-0.5,0.5,0.6", "orientation is not of length 1"},
      {"[1.0,2.0,-3.0]", "[1,2,-3000]", "force is out of range"},
      {"[1.0,2.0,-3.0]", "[1,2,true]", "force is not of numbers"},
      {"[0.1,0.2,-0.3]", "[0.1,0.2,-300]", "torque is out of range"},
      {"\"spindle\":true", "\"spindle\":1", "spindle is not true or false"},
  };
  for (const Case& c : cases) {
    const std::string said = fault(replaced(good, c.from, c.to));
    CAPTURE(c.to);
    CAPTURE(said);
    CHECK(said.find(c.says) != std::string::npos);
  }
  CHECK(fault("").find("not a JSON object") != std::string::npos);
  CHECK(fault(good + std::string(kLargestMessage, ' ')).find("longer than 1024") != std::string::npos);
  CHECK(fault(std::string(1000, '[')).find("not a JSON object") != std::string::npos);
}

TEST_CASE("Messages: damaged reports are refused or are reports in range") {
  const std::string good = to_json(some_report());
  Random random(5);
  int refused = 0;
  for (int n = 0; n < 20'000; ++n) {
    std::string text = good;
    for (int k = random.below(4); k >= 0; --k) {
      const auto at = static_cast<std::size_t>(random.below(static_cast<int>(text.size())));
      if (random.below(3) == 0)
        text.erase(at, static_cast<std::size_t>(1 + random.below(8)));
      else
        text[at] =
            random.below(2) == 0 ? static_cast<char>(random.below(256)) : "0123456789eE+-.,[]{}\""[random.below(21)];
      if (text.empty()) text = "x";
    }
    if (!fault(text).empty()) {
      ++refused;
      continue;
    }
    const Report r = read_report(text);
    CHECK(vector(r.measured_cp.position).norm() <= 2 * kFarthest);
    CHECK(is_usable_pose(pose(r.measured_cp)));
    CHECK(is_finite(wrench(r.measured_cf)));
  }
  CHECK(refused > 15'000);
}
