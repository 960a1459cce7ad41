// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <array>

/// The one place where the driver's units and storage become SI, and back. The driver counts in mm, N and mN·m and
/// stores a pose as a 4 x 4 matrix by columns, translation in elements 12 to 14. Its axes (+x right, +y up, +z toward
/// the user) are those of frame D as they are: turning, moving and scaling them is the servo loop's registration.
namespace openhaptics {

inline constexpr double kMetresPerMillimetre = 1e-3;
inline constexpr double kMillinewtonMetresPerNewtonMetre = 1e3;

/// X_DH [m] of a transform [mm].
[[nodiscard]] inline trephine::Posed pose_from_transform(const std::array<double, 16>& m) noexcept {
  trephine::Mat3d R;
  R << m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10];
  return trephine::make_pose<double>(R, kMetresPerMillimetre * trephine::Vec3d(m[12], m[13], m[14]));
}

/// N stay N.
[[nodiscard]] inline std::array<double, 3> force_to_driver(const trephine::Vec3d& f_N) noexcept {
  return {f_N.x(), f_N.y(), f_N.z()};
}

/// [mN·m] of a torque [N·m].
[[nodiscard]] inline std::array<double, 3> torque_to_driver(const trephine::Vec3d& t_Nm) noexcept {
  const trephine::Vec3d t = kMillinewtonMetresPerNewtonMetre * t_Nm;
  return {t.x(), t.y(), t.z()};
}

/// [N·m] of a torque [mN·m].
[[nodiscard]] inline double torque_from_driver(double t_mNm) noexcept {
  return t_mNm / kMillinewtonMetresPerNewtonMetre;
}

/// [N/m] of a stiffness [N/mm].
[[nodiscard]] inline double stiffness_from_driver(double k_N_mm) noexcept { return k_N_mm / kMetresPerMillimetre; }

}  // namespace openhaptics
