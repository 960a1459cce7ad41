// SPDX-License-Identifier: MIT
#pragma once

#include "messages.hpp"
#include "robot.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

namespace robots {

/// The other end of the bridge: a simulated robot at 1 kHz of real time, as a node for a real one would be.
class UdpRobot {
 public:
  UdpRobot(const boost::asio::ip::udp::endpoint& bridge, const Posed& X_WT)
      : socket_(context_, boost::asio::ip::udp::endpoint(boost::asio::ip::address_v4::loopback(), 0)), robot_(X_WT) {
    socket_.connect(bridge);
    socket_.non_blocking(true);
  }

  [[nodiscard]] const SimulatedRobot& robot() const noexcept { return robot_; }
  [[nodiscard]] const std::optional<Command>& command() const noexcept { return command_; }

  /// One period: waits for its time, takes the commands that have come, moves, and reports.
  void step(const Wrenchd& hand, bool spindle) {
    due_ = std::max(due_ + kPeriod, Clock::now() - kPeriod);  // after a stall it does not catch up
    std::this_thread::sleep_until(due_);
    listen();
    Report report = robot_.advance(hand, spindle, std::chrono::duration<double>(kPeriod).count());
    report.stamp = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
    send(to_json(report));
  }
  /// Takes the commands that have come, without a report.
  void listen() {
    boost::system::error_code error;
    for (int n = 0; n < kMostAtOnce; ++n) {
      const std::size_t size = socket_.receive(boost::asio::buffer(buffer_), 0, error);
      if (error) return;  // none is left, or nobody listens
      try {
        Command c = read_command(std::string_view(buffer_.data(), size));
        if (command_ && c.sequence <= command_->sequence) continue;
        robot_.command(c);
        command_ = std::move(c);
      } catch (const std::invalid_argument&) {
        // Nonsense is silence: the robot stops by its timeout.
      }
    }
  }
  void send(std::string_view text) {
    boost::system::error_code ignored;
    socket_.send(boost::asio::buffer(text.data(), text.size()), 0, ignored);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kPeriod{1};
  static constexpr int kMostAtOnce = 100;

  boost::asio::io_context context_;
  boost::asio::ip::udp::socket socket_;
  SimulatedRobot robot_;
  std::optional<Command> command_;
  std::array<char, kLargestMessage + 1> buffer_{};
  Clock::time_point due_ = Clock::now();
};

}  // namespace robots
