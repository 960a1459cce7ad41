// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace live {

using trephine::Mat3d;
using trephine::Posed;
using trephine::Vec3d;
using Vec2d = Eigen::Vector2d;

/// A half-line in W [m]; `direction` is unit.
struct ViewRay {
  Vec3d origin;
  Vec3d direction;
};

/// Camera that orbits a focus, with z of W upward on the screen. Perspective; pixels count from the upper left corner.
struct OrbitCamera {
  Vec3d focus_W = Vec3d::Zero();
  double yaw = 0;                                             ///< about z of W [rad]
  double pitch = 0.3;                                         ///< above the horizon [rad]
  double distance = 0.12;                                     ///< of the eye from the focus [m]
  static constexpr double kFieldOfView = 0.6;                 ///< angle over the picture's height [rad]
  static constexpr double kSteepest = 1.55;                   ///< largest |pitch| [rad]
  static constexpr double kNearest = 0.008, kFarthest = 1.5;  ///< bounds of `distance` [m]

  /// Returns the axes right, up, back of the screen as columns, in W.
  [[nodiscard]] Mat3d axes() const {
    const double c = std::cos(pitch), s = std::sin(pitch);
    Mat3d R;
    R.col(2) = Vec3d(c * std::cos(yaw), c * std::sin(yaw), s);
    R.col(0) = Vec3d(-std::sin(yaw), std::cos(yaw), 0);
    R.col(1) = R.col(2).cross(R.col(0));
    return R;
  }
  [[nodiscard]] Vec3d eye_W() const { return focus_W + distance * axes().col(2); }

  /// Looks along −`from_W`: the eye lies in that direction from the focus.
  void look_from(const Vec3d& from_W) {
    const Vec3d d = from_W.normalized();
    yaw = std::atan2(d.y(), d.x());
    pitch = std::clamp(std::asin(std::clamp(d.z(), -1.0, 1.0)), -kSteepest, kSteepest);
  }
  /// Turns by a drag of the mouse [pixels]: the picture's height is half a turn.
  void orbit(double dx, double dy, double height) {
    yaw -= dx / height * std::numbers::pi;
    pitch = std::clamp(pitch + dy / height * std::numbers::pi, -kSteepest, kSteepest);
  }
  /// Moves the focus with the mouse [pixels].
  void pan(double dx, double dy, double height) {
    const Mat3d R = axes();
    focus_W += metres_per_pixel(distance, height) * (-dx * R.col(0) + dy * R.col(1));
  }
  /// Comes closer by a factor of 1.15 for each notch.
  void zoom(double notches) { distance = std::clamp(distance * std::pow(1.15, -notches), kNearest, kFarthest); }

  /// Returns the length at `depth` [m] in front of the eye that a pixel covers [m].
  [[nodiscard]] static double metres_per_pixel(double depth, double height) {
    return 2 * depth * std::tan(kFieldOfView / 2) / height;
  }
  [[nodiscard]] ViewRay ray(double x, double y, double width, double height) const {
    const Mat3d R = axes();
    const double scale = metres_per_pixel(1, height);
    const Vec3d d = scale * ((x - width / 2) * R.col(0) - (y - height / 2) * R.col(1)) - R.col(2);
    return {eye_W(), d.normalized()};
  }
  /// Returns the pixel that shows a point in front of the eye: the inverse of `ray`.
  [[nodiscard]] Eigen::Vector2d pixel(const Vec3d& p_W, double width, double height) const {
    const Vec3d d = axes().transpose() * (p_W - eye_W());
    const double scale = metres_per_pixel(-d.z(), height);
    return {width / 2 + d.x() / scale, height / 2 - d.y() / scale};
  }
  /// Returns the depth of a point in front of the eye [m].
  [[nodiscard]] double depth(const Vec3d& p_W) const { return (eye_W() - p_W).dot(axes().col(2)); }
};

}  // namespace live
