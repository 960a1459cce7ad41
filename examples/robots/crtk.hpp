// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/wrench.hpp>

#include <array>
#include <cstdint>
#include <string>

/// What a robot reports and what it is commanded, with the names of CRTK, the Collaborative Robotics Toolkit. SI units,
/// W axes: W is the robot's base frame, T the tool at the burr's centre with +z along the shaft toward the handle.
namespace robots {

using namespace trephine;

enum class OperatingState : std::uint8_t { kDisabled, kEnabled, kPaused, kFault };

inline constexpr std::array kStateNames{"DISABLED", "ENABLED", "PAUSED", "FAULT"};

[[nodiscard]] constexpr const char* to_string(OperatingState s) noexcept {
  return kStateNames[static_cast<std::size_t>(s)];
}

/// Cartesian position: of T in W.
struct CartesianPosition {
  std::array<double, 3> position{};               ///< [m]
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< unit quaternion x, y, z, w
};
/// Cartesian velocity of T.
struct CartesianVelocity {
  std::array<double, 3> linear{};   ///< [m/s]
  std::array<double, 3> angular{};  ///< [rad/s]
};
/// Cartesian force, about T's origin.
struct CartesianForce {
  std::array<double, 3> force{};   ///< [N]
  std::array<double, 3> torque{};  ///< [N·m]
};

/// What the robot measures, once a period.
struct Report {
  std::uint64_t sequence = 0;  ///< grows from message to message
  double stamp = 0;            ///< time of the measurement on the robot's clock [s]
  OperatingState operating_state = OperatingState::kDisabled;
  CartesianPosition measured_cp;
  CartesianForce measured_cf;  ///< of the hand on the tool
  bool spindle = false;        ///< it turns
};

/// What the robot shall do. It takes one of the three: a position, a velocity or a force.
struct Command {
  std::uint64_t sequence = 0;                                ///< grows from message to message
  std::uint64_t answers = 0;                                 ///< sequence number of the last report that was used
  double stamp = 0;                                          ///< of the command on the sender's clock [s]
  OperatingState operating_state = OperatingState::kPaused;  ///< kEnabled: moves; kPaused: zero, for the reason below
  CartesianPosition servo_cp;
  CartesianVelocity servo_cv;
  CartesianForce servo_cf;  ///< of bone on the tool, for a robot whose motors give forces
  double distance = 0;      ///< of the commanded tool from the nearest protected structure [m]
  bool limited = false;     ///< the barrier changed the motion
  std::string reason;       ///< why nothing moves; empty while it does
};

[[nodiscard]] inline Vec3d vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
[[nodiscard]] inline std::array<double, 3> numbers(const Vec3d& v) { return {v.x(), v.y(), v.z()}; }

[[nodiscard]] inline Posed pose(const CartesianPosition& p) {
  const auto& [x, y, z, w] = p.orientation;
  return make_pose<double>(Quatd(w, x, y, z).normalized().toRotationMatrix(), vector(p.position));
}
[[nodiscard]] inline CartesianPosition position(const Posed& X_WT) {
  const Quatd q(Mat3d(X_WT.linear()));
  return {numbers(X_WT.translation()), {q.x(), q.y(), q.z(), q.w()}};
}
[[nodiscard]] inline Wrenchd wrench(const CartesianForce& f) { return {vector(f.force), vector(f.torque)}; }
[[nodiscard]] inline CartesianForce force(const Wrenchd& w) { return {numbers(w.force), numbers(w.torque)}; }
[[nodiscard]] inline CartesianVelocity velocity(const Twist& v) { return {numbers(v.linear), numbers(v.angular)}; }

}  // namespace robots
