// SPDX-License-Identifier: MIT
// The bridge at its socket: silence, floods, nonsense, and either end gone.
#include "support/near.hpp"
#include "udp_bridge.hpp"
#include "udp_robot.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <string>
#include <thread>

using namespace robots;

namespace {

/// A bridge in a thread of its own. Its rules are as in use, except that it starts sooner and bears a slow machine.
class Bridge {
 public:
  Bridge() {
    thread_ = std::thread([this] { context_.run(); });
  }
  ~Bridge() { end(); }
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  [[nodiscard]] const udp::endpoint& endpoint() const { return endpoint_; }
  /// Ends it as a killed process does: without a word.
  void end() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
  }
  /// Lines said; read it after `end`.
  [[nodiscard]] int lines() const { return lines_; }

 private:
  DrillCell cell_;
  int lines_ = 0;
  BridgeCore core_{cell_, [this](const std::string&) { ++lines_; }, {.oldest = 0.1, .settle = 0.02}};
  asio::io_context context_;
  UdpBridge bridge_{context_, asio::ip::address_v4::loopback(), 0, core_};
  udp::endpoint endpoint_ = bridge_.endpoint();
  std::thread thread_;
};

const Wrenchd kHand{Vec3d(10, 0, 0), Vec3d::Zero()};

/// Reports, with the hand pushing, until the robot is commanded to move fast; false if that takes 20 s.
bool set_off(UdpRobot& robot) {
  for (int tick = 0; tick < 20'000; ++tick) {
    robot.step(kHand, false);
    if (robot.command() && robot.command()->operating_state == OperatingState::kEnabled &&
        vector(robot.command()->servo_cv.linear).norm() > 0.01)
      return true;
  }
  return false;
}

/// Waits for a command that stops, without a report, for a second at most.
bool hears_zero(UdpRobot& robot) {
  for (int n = 0; n < 2000; ++n) {
    robot.listen();
    if (robot.command()->operating_state == OperatingState::kPaused)
      return vector(robot.command()->servo_cv.linear).isZero() && wrench(robot.command()->servo_cf) == Wrenchd::zero();
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  return false;
}

}  // namespace

TEST_CASE("UdpBridge: it listens at the loopback address alone") {
  Bridge bridge;
  CHECK(bridge.endpoint().address().is_loopback());
  CHECK(bridge.endpoint().port() != 0);
}

TEST_CASE("UdpBridge: a robot that is gone is commanded zero within 10 ms") {
  Bridge bridge;
  double soonest = 1;
  // By the bridge's clock, from its last answer to a report. A loaded machine may be late to wake it, but not each
  // time.
  for (int trial = 0; trial < 10 && soonest > 0.010; ++trial) {
    UdpRobot robot(bridge.endpoint(), DrillCell::start());
    REQUIRE(set_off(robot));
    robot.listen();
    std::this_thread::sleep_for(std::chrono::microseconds(500));
    double last = robot.command()->stamp;
    REQUIRE(hears_zero(robot));
    soonest = std::min(soonest, robot.command()->stamp - last);
    CHECK_FALSE(robot.command()->reason.empty());
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // until another may come
  }
  std::cout << "zero " << 1e3 * soonest << " ms after the last answer\n";
  CHECK(soonest <= 0.010);
  CHECK(soonest > 0.004);
}

TEST_CASE("UdpBridge: nonsense and floods stop the robot") {
  Bridge bridge;
  UdpRobot robot(bridge.endpoint(), DrillCell::start());
  // Beyond the largest message, of a datagram's largest size, empty, binary, and unfinished.
  for (const std::string& text : {std::string(1100, ' '), std::string(60'000, '['), std::string(),
                                  std::string("\0\xff\xfe{", 4), std::string("{\"sequence\":1")}) {
    REQUIRE(set_off(robot));
    robot.send(text);
    CHECK(hears_zero(robot));
    CHECK_FALSE(robot.command()->reason.empty());  // a busy machine's silence may come first
  }
  REQUIRE(set_off(robot));
  for (int n = 0; n < 5000; ++n) robot.send("{}");
  CHECK(hears_zero(robot));
  CHECK(set_off(robot));  // and it goes on
  bridge.end();
  CHECK(bridge.lines() >= 7 * 2 - 1);
  CHECK(bridge.lines() < 100);
}

TEST_CASE("UdpBridge: a robot whose bridge is gone stands after 10 ms and the time to brake") {
  Bridge bridge;
  UdpRobot robot(bridge.endpoint(), DrillCell::start());
  REQUIRE(set_off(robot));
  bridge.end();
  // By the robot's own periods: 10 of silence, one for what was on its way, and 6 from 30 mm/s by 5 m/s².
  for (int tick = 0; tick < 18; ++tick) robot.step(kHand, false);
  CHECK(robot.robot().twist().linear.isZero());
}
