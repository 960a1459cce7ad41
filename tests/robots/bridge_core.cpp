// SPDX-License-Identifier: MIT
// The bridge's rules on a clock of the test's own.
#include "bridge_core.hpp"

#include "support/near.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

using namespace robots;
using trephine::test::near;
using trephine::test::within;

namespace {

constexpr BridgeCore::Sender kRobot = 1, kStranger = 2;

/// A bridge and a robot at 1 kHz whose clock is 1000 s behind.
struct Fixture {
  DrillCell cell;
  std::vector<std::string> lines;
  BridgeCore core{cell, [this](const std::string& line) { lines.push_back(line); }};
  double now = 5000;
  Report report;
  double pushes = 5;  // [N]

  Fixture() {
    report.operating_state = OperatingState::kEnabled;
    report.measured_cp = position(DrillCell::start());
  }
  /// Returns the answer to a good report a millisecond later; the robot follows.
  Command step(double delay = 0) {
    now += 1e-3;
    ++report.sequence;
    report.stamp = now - 1000 - delay;
    report.measured_cf.force = {pushes, 0, 0};
    (void)core.watch(now);
    const std::optional<Command> c = core.receive(to_json(report), kRobot, now);
    REQUIRE(c);
    if (c->operating_state == OperatingState::kEnabled) report.measured_cp = c->servo_cp;
    return *c;
  }
  void run(int ticks) {
    for (int tick = 0; tick < ticks; ++tick) (void)step();
    REQUIRE(core.moves());
  }
};

bool is_zero(const Command& c) {
  return c.operating_state == OperatingState::kPaused && vector(c.servo_cv.linear).isZero() &&
         vector(c.servo_cv.angular).isZero() && wrench(c.servo_cf) == Wrenchd::zero();
}

}  // namespace

TEST_CASE("BridgeCore: it moves after a tenth of a second of good reports") {
  Fixture f;
  for (int tick = 0; tick <= 99; ++tick) CHECK(is_zero(f.step()));
  f.run(2);
  f.run(300);
  const Command c = f.step();
  CHECK(c.servo_cv.linear[0] == near(5e-3 * 4.8, 1e-6));
  CHECK(c.answers == f.report.sequence);
  CHECK(c.stamp == f.now);
  CHECK(f.lines == std::vector<std::string>{"moves"});
}

TEST_CASE("BridgeCore: each fault gives zero at once, one line, and rest until a tenth of a second of good reports") {
  struct Case {
    const char* says;
    std::function<std::optional<Command>(Fixture&)> fault;
  };
  const auto send = [](Fixture& f, const std::string& text, BridgeCore::Sender from = kRobot) {
    return f.core.receive(text, from, f.now);
  };
  const std::vector<Case> cases{
      {"not a JSON object", [&](Fixture& f) { return send(f, "stop"); }},
      {"not a JSON object", [&](Fixture& f) { return send(f, ""); }},
      {"longer than 1024", [&](Fixture& f) { return send(f, std::string(kLargestMessage + 1, ' ')); }},
      {"another sender", [&](Fixture& f) { return send(f, to_json(f.report), kStranger); }},
      {"another sender", [&](Fixture& f) { return send(f, "nonsense", kStranger); }},
      {"sequence does not grow", [&](Fixture& f) { return send(f, to_json(f.report)); }},
      {"stamp does not grow",
       [&](Fixture& f) {
         ++f.report.sequence;
         return send(f, to_json(f.report));
       }},
      {"the robot is FAULT",
       [&](Fixture& f) {
         f.report.operating_state = OperatingState::kFault;
         const Command c = f.step();
         f.report.operating_state = OperatingState::kEnabled;
         return std::optional(c);
       }},
      {"too far from its command",
       [&](Fixture& f) {
         f.report.measured_cp.position[0] += 2e-3;
         return std::optional(f.step());
       }},
      {"no good report for 5 ms",
       [&](Fixture& f) {
         std::optional<Command> zero;
         const double last = f.now;
         while (!zero && f.now < last + 0.01) zero = f.core.watch(f.now += 1e-3);
         CHECK(f.now - last < 0.0065);
         return zero;
       }},
      {"flood",
       [&](Fixture& f) {
         std::optional<Command> zero;
         for (int n = 0; n < 100 && !zero; ++n) {
           ++f.report.sequence;
           f.report.stamp += 1e-6;
           const std::optional<Command> c = f.core.receive(to_json(f.report), kRobot, f.now);
           if (c && is_zero(*c)) zero = c;
         }
         for (int n = 0; n < 1000; ++n) CHECK_FALSE(f.core.receive("{", kStranger, f.now));  // not even read
         return zero;
       }},
  };
  for (const Case& c : cases) {
    CAPTURE(c.says);
    Fixture f;
    f.run(200);
    f.lines.clear();
    const std::optional<Command> zero = c.fault(f);
    REQUIRE(zero);
    CHECK(is_zero(*zero));
    CHECK(zero->reason.find(c.says) != std::string::npos);
    CHECK_FALSE(f.core.moves());
    REQUIRE(f.lines.size() == 1);
    CHECK(f.lines[0].find(c.says) != std::string::npos);
    f.now += 0.01;  // past the window in which messages are counted; the test's robot was silent
    f.report.stamp = f.now - 1000;
    for (int tick = 0; tick < 99; ++tick) CHECK(is_zero(f.step()));
    CHECK(f.lines.size() == 1);
    f.run(3);
    // It starts from where the robot is, slowly.
    const Command first = f.step();
    CHECK(vector(first.servo_cv.linear).norm() < 2e-3);
    CHECK((vector(first.servo_cp.position) - vector(f.report.measured_cp.position)).norm() < 1e-9);
  }
}

TEST_CASE("BridgeCore: a robot that starts in bone is not kicked: its force rises from zero") {
  Fixture f;
  f.report.measured_cp.position[2] = 18e-3;  // 0.5 mm deep
  f.pushes = 0;
  f.run(102);
  double before = 0, most = 0;
  for (int tick = 0; tick < 100; ++tick) {
    const double now = vector(f.step().servo_cf.force).norm();
    CHECK(now - before < 0.02);
    before = now;
    most = std::max(most, now);
  }
  CHECK(most > 0.2);
}

TEST_CASE("BridgeCore: a late report stops it whatever the clocks, and slow drift does not") {
  Fixture f;
  f.run(200);
  double delay = 0;  // of messages that queue up
  while (delay < 0.02 && !is_zero(f.step(delay))) delay += 0.9e-3;
  CHECK(delay == within(0.010, 1e-3));
  CHECK(f.lines.back().find("late by more than 10 ms") != std::string::npos);
  Fixture drifts;
  drifts.run(200);
  for (int tick = 0; tick < 60'000; ++tick) REQUIRE_FALSE(is_zero(drifts.step(200e-6 * 1e-3 * tick)));  // 200 ppm
}

TEST_CASE("BridgeCore: nonsense before there is a robot is one line and no answer") {
  Fixture f;
  for (int n = 0; n < 1000; ++n) CHECK_FALSE(f.core.receive("nonsense", kStranger, f.now += 1e-3));
  CHECK(f.lines.size() == 1);
  CHECK_FALSE(f.core.robot());
}

TEST_CASE("BridgeCore: a steady mixture of good and bad messages never moves and says one line") {
  Fixture f;
  f.run(200);
  f.lines.clear();
  for (int tick = 0; tick < 3000; ++tick) {
    if (tick % 50 == 0) (void)f.core.receive("nonsense", kStranger, f.now);
    CHECK(is_zero(f.step()));
  }
  CHECK(f.lines.size() == 1);
}

TEST_CASE("BridgeCore: a second of silence lets another robot in") {
  Fixture f;
  f.run(200);
  const double last = f.now;
  int zeros = 0;
  while (f.core.robot() && f.now < last + 2) zeros += f.core.watch(f.now += 1e-3).has_value();
  CHECK(f.now - last == within(1, 0.01));
  CHECK(zeros > 900);  // the robot may hear again
  f.report.sequence = 0;
  f.now += 1;
  ++f.report.sequence;
  f.report.stamp = 3;
  const std::optional<Command> c = f.core.receive(to_json(f.report), kStranger, f.now);
  REQUIRE(c);
  CHECK(is_zero(*c));
  CHECK(f.core.robot() == kStranger);
}
