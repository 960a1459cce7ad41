// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/rotation.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/springs.hpp>

#include <cmath>

/// Virtual coupling: a spring for translation and a spring for rotation between the device's pose and the virtual
/// tool's (Colgate 1995; Wan and McNeely 2003).
namespace trephine::inline TREPHINE_ALIGNED {

/// Pose error of the virtual tool, and the coupling's springs there, about the tool's origin, in G.
struct PoseError {
  Vec3d translation = Vec3d::Zero();  ///< from the virtual tool to the device [m]
  Vec3d rotation = Vec3d::Zero();     ///< likewise, a rotation vector [rad]
  SpringResponse force, torque;       ///< along translation and rotation
  double energy = 0;                  ///< of both springs [J]
};

/// The springs for translation and rotation. A tool whose rotation is not solved for has the device's.
struct VirtualCoupling {
  CompensatedSpring translation_spring;
  BoundedSpring rotation_spring;
  bool solves_rotation = false;

  /// Pose error of a virtual tool at X, with the springs' forces.
  [[nodiscard]] PoseError evaluate(const Posed& X, const Posed& X_device) const noexcept {
    return evaluate(X_device.translation() - X.translation(),
                    solves_rotation ? turn_between(X, X_device) : Vec3d(Vec3d::Zero()));
  }
  /// The same for a translation [m] and a rotation vector [rad] from the virtual tool to the device.
  [[nodiscard]] PoseError evaluate(const Vec3d& translation, const Vec3d& rotation) const noexcept {
    PoseError error{translation, rotation, translation_spring.evaluate(translation.norm()), {}, 0};
    error.energy = error.force.energy;
    if (!solves_rotation) return error;
    error.torque = rotation_spring.evaluate(rotation.norm());
    error.energy += error.torque.energy;
    return error;
  }

  /// Force [N] and torque [N·m] on the virtual tool, which is −∂E. The hand feels the opposite.
  [[nodiscard]] static Vec6d wrench(const PoseError& error) noexcept {
    const double distance = error.translation.norm(), angle = error.rotation.norm();
    return spatial((distance > 0 ? error.force.magnitude / distance : 0.0) * error.translation,
                   (angle > 0 ? error.torque.magnitude / angle : 0.0) * error.rotation);
  }

  /// Adds the coupling's Hessian ∂²E: its positive definite part to `stiffness`, and the part by which rotations do not
  /// commute to `geometric_stiffness`.
  void add_hessian(const PoseError& error, Mat6d& stiffness, Mat6d& geometric_stiffness) const noexcept {
    const double distance = error.translation.norm();
    const double secant = distance > 0 ? error.force.magnitude / distance : error.force.tangent;
    // A saturated force has no stiffness along its direction. The secant keeps steps bounded, and downhill.
    const double along = error.force.tangent > 0 ? error.force.tangent : secant;
    const Vec3d direction = error.translation / (distance > 0 ? distance : 1);
    add_block(stiffness, 0, 0, outer(along - secant, direction, direction));
    add_to_diagonal(stiffness, 0, secant);
    if (!solves_rotation) return;
    const double angle = error.rotation.norm();
    const double k = angle > 0 ? error.torque.magnitude / angle : rotation_spring.stiffness;
    // Second derivative of ½|log|²: 1 along the rotation axis, (φ/2) cot (φ/2) across.
    const double across = angle > CoupledConstants::kSmallRotation ? (angle / 2) / std::tan(angle / 2) : 1.0;
    const Vec3d axis = error.rotation / (angle > 0 ? angle : 1);
    add_to_diagonal(stiffness, 3, k);
    add_block(geometric_stiffness, 3, 3, outer(k * (1 - across), axis, axis));
    add_to_diagonal(geometric_stiffness, 3, -k * (1 - across));
  }
};

}  // namespace trephine
