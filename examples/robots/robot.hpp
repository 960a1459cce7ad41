// SPDX-License-Identifier: MIT
#pragma once

#include "crtk.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/structure/motion_barrier.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>

namespace robots {

/// Options of a `SimulatedRobot`.
struct RobotOptions {
  double time_constant = 4e-3;     ///< of the position controllers [s]
  double acceleration = 5;         ///< largest [m/s²]
  double turn_acceleration = 100;  ///< largest [rad/s²]
  double speed = 0.25;             ///< largest [m/s]
  double turn_speed = 3;           ///< largest [rad/s]
  double force_noise = 0.048;      ///< of the sensor, standard deviation of each component [N]
  double torque_noise = 5e-4;      ///< likewise [N·m]
  double timeout = 0.010;          ///< without a command for that long it stops [s]
  unsigned seed = 1;               ///< of the noise
};

/// An arm under position control that holds a tool, with a force sensor at its handle: it trails its command by a
/// first-order lag and two periods, within limits of speed and acceleration. Its report is of one period ago.
///
/// It stops where it is when its command says so, or when no command has come for `timeout`.
class SimulatedRobot {
 public:
  explicit SimulatedRobot(const Posed& X_WT, const RobotOptions& options = {})
      : options_(options), X_WT_(X_WT), X_WT_before_(X_WT), noise_(options.seed) {
    targets_.fill({X_WT, false});
  }

  [[nodiscard]] const Posed& X_WT() const noexcept { return X_WT_; }
  [[nodiscard]] const Twist& twist() const noexcept { return twist_; }

  /// Takes a command: the newest of a period counts.
  void command(const Command& c) noexcept {
    targets_[0] = {pose(c.servo_cp), c.operating_state == OperatingState::kEnabled};
    silent_ = 0;
  }

  /// Moves for dt [s] and returns what the robot reports then, with `hand` on the tool.
  [[nodiscard]] Report advance(const Wrenchd& hand, bool spindle, double dt) {
    X_WT_before_ = X_WT_;
    silent_ += dt;
    if (silent_ > options_.timeout) targets_[0].moves = false;
    const Target target = targets_.back();
    std::copy_backward(targets_.begin(), targets_.end() - 1, targets_.end());
    Vec3d e = target.X_WT.translation() - X_WT_.translation(), turn = turn_between(X_WT_, target.X_WT);
    if (!target.moves || !targets_[0].moves) e.setZero(), turn.setZero();
    follow(e, options_.speed, options_.acceleration, dt, twist_.linear);
    follow(turn, options_.turn_speed, options_.turn_acceleration, dt, twist_.angular);
    X_WT_ = pose_after(X_WT_, twist_, dt);
    time_ += dt;
    return {.sequence = ++sequence_,
            .stamp = time_,
            .operating_state = OperatingState::kEnabled,
            .measured_cp = position(X_WT_before_),
            .measured_cf =
                force(Wrenchd{hand.force + noise(options_.force_noise), hand.torque + noise(options_.torque_noise)}),
            .spindle = spindle};
  }

 private:
  static constexpr std::size_t kLatency = 2;  // periods until a command acts

  struct Target {
    Posed X_WT = Posed::Identity();
    bool moves = false;
  };

  /// Changes the velocity v toward an error e's share per time constant, or what can still brake before e ends.
  void follow(const Vec3d& e, double speed, double acceleration, double dt, Vec3d& v) const noexcept {
    constexpr double kBraking = 1.6;  // of 2 a e: the rest is for the period
    const double size = e.norm();
    const double fast = std::min({size / options_.time_constant, std::sqrt(kBraking * acceleration * size), speed});
    const Vec3d change = (size > 0 ? Vec3d(fast / size * e) : Vec3d::Zero()) - v;
    const double most = acceleration * dt;
    v += change.norm() > most ? Vec3d(most / change.norm() * change) : change;
  }
  [[nodiscard]] Vec3d noise(double deviation) {
    std::array<double, 3> n{};
    for (double& x : n) x = deviation * normal_(noise_);
    return vector(n);
  }

  RobotOptions options_;
  Posed X_WT_, X_WT_before_;
  Twist twist_;
  std::array<Target, kLatency + 1> targets_;  // [0] is the newest
  double silent_ = 0;                         // since the last command [s]
  double time_ = 0;
  std::uint64_t sequence_ = 0;
  std::mt19937 noise_;
  std::normal_distribution<double> normal_;
};

}  // namespace robots
