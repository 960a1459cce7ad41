// SPDX-License-Identifier: MIT
#pragma once

#include "drill_cell.hpp"
#include "messages.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace robots {

/// Times of a `BridgeCore` [s].
struct BridgeOptions {
  double silence = 0.005;  ///< without a report for that long it stops: half of 10 ms, the rest is for a late timer
  double oldest = 0.010;   ///< age from which a report stops it
  double settle = 0.1;     ///< of good reports before it moves, at first and after each stop
  double session = 1;      ///< of silence after which it takes another sender
  double window = 0.010;   ///< in which it counts messages ...
  int flood = 40;          ///< ... and so many are the most
};

/// The bridge without sockets: messages of one robot in, commands out. Whatever is wrong (a message, its sender, its
/// age, too many, none) stops it: the command is then PAUSED with zero velocity and force, one line is said, and after
/// `settle` of good reports it starts from rest where the robot is.
///
/// Clocks of robot and bridge may differ: the age of a report counts from the freshest one. The estimate forgets 1 ms a
/// second, more than clocks drift.
class BridgeCore {
 public:
  using Sender = std::uint64_t;  ///< address and port
  using Say = std::function<void(const std::string&)>;

  BridgeCore(DrillCell& cell, Say say, const BridgeOptions& options = {})
      : cell_(cell), say_(std::move(say)), options_(options) {}

  /// The robot whose reports are heard, if there is one: commands go to it alone.
  [[nodiscard]] std::optional<Sender> robot() const noexcept { return robot_; }
  [[nodiscard]] bool moves() const noexcept { return moves_; }

  /// Takes a datagram that came at `now` on the bridge's clock; returns the command to be sent, if any.
  [[nodiscard]] std::optional<Command> receive(std::string_view text, Sender from, double now) {
    if (now - window_start_ >= options_.window) window_start_ = now, in_window_ = 0;
    if (++in_window_ > options_.flood) {
      if (in_window_ > options_.flood + 1) return std::nullopt;  // said and answered
      return stop("flood: more than " + std::to_string(options_.flood) + " messages in a window", now);
    }
    if (robot_ && *robot_ != from) return stop("message of another sender", now);
    try {
      return answer(read_report(text), from, now);
    } catch (const std::exception& error) {
      return stop(std::string("bad message: ") + error.what(), now);
    }
  }

  /// Call it at least every millisecond: returns a zero command while the robot is silent.
  [[nodiscard]] std::optional<Command> watch(double now) {
    if (!robot_ || now - last_good_ <= options_.silence) return std::nullopt;
    const std::optional<Command> zero = stop("no good report for " + milliseconds(options_.silence), now);
    if (now - last_good_ > options_.session) robot_.reset();
    return zero;
  }

 private:
  static constexpr double kForget = 1e-3;  // of the clocks' difference [s/s]

  [[nodiscard]] static std::string milliseconds(double t) { return std::to_string(std::lround(1e3 * t)) + " ms"; }

  [[nodiscard]] std::optional<Command> answer(const Report& r, Sender from, double now) {
    const double difference = now - r.stamp;
    double dt = 0;
    if (robot_) {
      if (r.sequence <= last_.sequence) return stop("sequence does not grow", now);
      if (!(r.stamp > last_.stamp)) return stop("stamp does not grow", now);
      dt = r.stamp - last_.stamp;
      least_difference_ = std::min(difference, least_difference_ + kForget * (now - last_time_));
    } else {
      robot_ = from;
      hold_ = r.measured_cp;
      last_bad_ = now;
      least_difference_ = difference;
    }
    last_ = r;
    last_time_ = now;
    if (const double age = difference - least_difference_; age > options_.oldest)
      return stop("report is late by more than " + milliseconds(options_.oldest), now);
    last_good_ = now;
    if (r.operating_state != OperatingState::kEnabled)
      return stop(std::string("the robot is ") + to_string(r.operating_state), now);
    if (!moves_) {
      if (now - last_bad_ < options_.settle) return zero(now);
      cell_.restart(r);
      moves_ = true;
      is_said_ = false;
      say_("moves");
    }
    Command c = cell_.tick(r, dt);
    if (cell_.lost()) return stop("the robot is too far from its command", now);
    hold_ = c.servo_cp;
    return stamped(std::move(c), now);
  }

  /// Stops, says why unless a reason stands already, and returns zero for the robot, if there is one.
  [[nodiscard]] std::optional<Command> stop(const std::string& reason, double now) {
    last_bad_ = now;
    moves_ = false;
    if (!is_said_) {
      is_said_ = true;
      reason_ = reason;
      say_("stops: " + reason);
    }
    return robot_ ? zero(now) : std::nullopt;
  }
  [[nodiscard]] std::optional<Command> zero(double now) {
    Command c;
    c.servo_cp = hold_;
    c.reason = is_said_ ? reason_ : "waits for steady reports";
    c.distance = std::min(cell_.barrier().distance(pose(hold_)).distance, 1e3);
    return stamped(std::move(c), now);
  }
  [[nodiscard]] Command stamped(Command c, double now) {
    c.sequence = ++sequence_;
    c.answers = last_.sequence;
    c.stamp = now;
    return c;
  }

  DrillCell& cell_;
  Say say_;
  BridgeOptions options_;
  std::optional<Sender> robot_;
  Report last_;
  CartesianPosition hold_;  // of a command that does not move
  double last_time_ = 0, last_good_ = 0, last_bad_ = 0;
  double least_difference_ = 0;  // of the bridge's clock and the robot's, with the least delay
  double window_start_ = 0;
  int in_window_ = 0;
  std::uint64_t sequence_ = 0;
  bool moves_ = false;
  bool is_said_ = false;
  std::string reason_;
};

}  // namespace robots
