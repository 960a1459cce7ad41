// SPDX-License-Identifier: MIT
#pragma once

#include "messages.hpp"

#include <trephine/device/leap.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace haply {

using Clock = std::chrono::steady_clock;

/// Times and bounds of the protection. What a hand may feel of any failure ends 10 ms after it.
struct Bounds {
  /// Longest wait for a state before a zero force goes out. A service at 200 Hz takes 5 ms; 10 ms less the way.
  Clock::duration reply = std::chrono::microseconds(6500);
  /// Longest wait for the servo loop's next force before a zero goes out.
  Clock::duration tick = std::chrono::microseconds(6500);
  /// A moving arm that repeats one position for this long is frozen.
  Clock::duration frozen = std::chrono::milliseconds(7);
  /// `read` trips by itself where its state is older.
  Clock::duration old = std::chrono::milliseconds(10);
  /// Silence after which the connection is closed and opened again.
  Clock::duration lost = std::chrono::milliseconds(100);
  /// The state has to be good for this long before a force follows a trouble.
  Clock::duration settle = std::chrono::milliseconds(50);
  /// Longest age of the handle's rotation; 0: none, because a handle at rest may repeat itself.
  Clock::duration handle_limit = std::chrono::milliseconds(0);
  /// An arm of this speed leaves its position in `frozen`, by 0.07 mm, which encoders resolve [m/s].
  double moving = 0.01;
  /// Fastest credible motion between two states, with an allowance for one late state [m/s, m].
  double fastest = trephine::kFastestHandle;
  double allowance = 0.002;
  /// Time in which the shown rotation follows the handle's: a period of its 50 to 60 Hz. Unfiltered, each sample would
  /// throw a tool's tip by millimetres within one tick [s].
  double handle_period = 0.018;
};

/// Checks the sequence of states, each of which `parse_state` found good by itself, and smooths the handle's rotation.
/// No clock of its own, so that tests choose the times. Allocates nothing.
class StateCheck {
 public:
  explicit StateCheck(const Bounds& bounds = {}) : bounds_(bounds) {}

  /// Takes the state that arrived at `now`, with the trouble its message had, and replaces its rotation by the smoothed
  /// one. A trouble ends once the states have been good for the time of settling.
  void add(Reading& reading, Trouble of_message, Clock::time_point now) {
    const Trouble found = of_message != Trouble::kNone ? of_message : compare(reading, now);
    if (found != Trouble::kNone) return fail(found, now);
    if (now - failed_ >= bounds_.settle) trouble_ = Trouble::kNone;
  }

  /// Tells of a trouble, also of one that is no state's own: silence, a lost connection.
  void fail(Trouble found, Clock::time_point now) {
    // The first names the failure, unless it only says that something is late or missing.
    const bool is_vague = trouble_ == Trouble::kNone || trouble_ == Trouble::kStart || trouble_ == Trouble::kTick ||
                          trouble_ == Trouble::kSilent || trouble_ == Trouble::kLost;
    if (is_vague) trouble_ = found;
    failed_ = now;
  }

  /// The states of a new connection have nothing to do with the last one's.
  void forget() { has_last_ = false; }

  /// Why no force may follow the last state; kNone: it may.
  [[nodiscard]] Trouble trouble() const { return trouble_; }

  /// When the handle's rotation last changed.
  [[nodiscard]] Clock::time_point turned() const { return turned_; }

 private:
  Trouble compare(Reading& reading, Clock::time_point now) {
    const bool first = !has_last_;
    const double dt = first ? 0 : std::chrono::duration<double>(now - arrived_).count();
    const bool jumped =
        !first && !((reading.position - last_.position).norm() <= bounds_.fastest * dt + bounds_.allowance);
    if (first || reading.position != last_.position) moved_ = now;
    if (first || reading.rotation.coeffs() != last_.rotation.coeffs()) turned_ = now;
    const bool frozen = reading.velocity.norm() > bounds_.moving && now - moved_ >= bounds_.frozen;
    last_ = reading;
    arrived_ = now;
    has_last_ = true;
    const double share = first ? 1 : 1 - std::exp(-dt / bounds_.handle_period);
    shown_ = first ? reading.rotation : shown_.slerp(share, reading.rotation).normalized();
    reading.rotation = shown_;
    if (jumped) return Trouble::kJump;
    if (bounds_.handle_limit > Clock::duration::zero() && now - turned_ > bounds_.handle_limit) return Trouble::kHandle;
    return frozen ? Trouble::kFrozen : Trouble::kNone;
  }

  Bounds bounds_;
  Trouble trouble_ = Trouble::kStart;
  Clock::time_point failed_ = Clock::now();
  bool has_last_ = false;
  Reading last_;
  trephine::Quatd shown_ = trephine::Quatd::Identity();
  Clock::time_point arrived_, moved_, turned_;
};

}  // namespace haply
