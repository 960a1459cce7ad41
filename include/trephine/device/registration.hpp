// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/wrench.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A similarity transform from a device's workspace to the world. The tool point T is fixed to the handle at `X_HT`
/// (handle frame H, real metres at the hand). Its motion in the device's base frame D is scaled by `scale` about D's
/// origin, then rotated and translated by `X_WD`:
///
///     X_DT = X_DH * X_HT,   p_WT = X_WD * (scale * p_DT),   R_WT = R_WD * R_DT.
///
/// A scale below 1 suits fine work: if the hand moves 1 m, the drill moves `scale` metres; angles are not scaled.
///
/// The force returns unscaled, rotated into D. So energy at the hand is energy in the world divided by `scale`. The
/// free torque about T is divided by `scale`, so that the same holds for rotation, as if the hand held an enlarged
/// world with longer lever arms. A law with a potential then keeps a potential, and no closed path of the hand
/// generates energy:
///
///     f_D = R_DW f_W,   τ_H = R_DW τ_T / scale + p_HT_D × f_D,   power at the hand = power in the world / scale.
///
/// So a stiffness k [N/m] in the world is felt as scale · k, a rotational stiffness k [N·m/rad] as k / scale.
/// Immutable; all members may be called from any thread and do not allocate.
class Registration {
 public:
  /// World, device and tool frames coincide.
  Registration() = default;

  /// Throws std::invalid_argument unless the poses are finite, their linear parts are rotations, and scale is finite
  /// and > 0. Rotations may err by 1e-6 and are made orthonormal to rounding.
  explicit Registration(const Posed& X_WD, const Posed& X_HT = Posed::Identity(), double scale = 1.0)
      : X_WD_(checked(X_WD, "X_WD")), X_HT_(checked(X_HT, "X_HT")), scale_(scale) {
    if (!(scale > 0) || !is_finite(scale)) refuse("Registration", "scale must be > 0 and finite", scale);
  }

  /// Returns the tool's pose X_WT for a handle at X_DH.
  [[nodiscard]] Posed tool_pose(const Posed& X_DH) const noexcept {
    const Mat3d R_DH = X_DH.linear(), R_WD = X_WD_.linear();
    const Vec3d p_DT = R_DH * X_HT_.translation() + X_DH.translation();
    return make_pose(Mat3d(R_WD * Mat3d(R_DH * X_HT_.linear())),
                     Vec3d(R_WD * Vec3d(scale_ * p_DT) + X_WD_.translation()));
  }

  /// Returns the inverse: the handle's pose X_DH for a tool at X_WT. It serves to script a hand along a path in the
  /// world.
  [[nodiscard]] Posed handle_pose(const Posed& X_WT) const noexcept {
    const Mat3d R_DW = inverse_rotation(X_WD_), R_DT = R_DW * X_WT.linear();
    const Vec3d p_DT = R_DW * Vec3d((X_WT.translation() - X_WD_.translation()) / scale_);
    const Mat3d R_DH = R_DT * inverse_rotation(X_HT_);
    return make_pose(R_DH, Vec3d(p_DT - R_DH * X_HT_.translation()));
  }

  /// Returns the wrench at the hand (about H, D axes) for `wrench_T_W` (about T, W axes) and a handle at X_DH.
  [[nodiscard]] Wrenchd device_wrench(const Wrenchd& wrench_T_W, const Posed& X_DH) const noexcept {
    const Mat3d R_DW = inverse_rotation(X_WD_);
    Wrenchd wrench = wrench_T_W.rotated(R_DW);
    wrench.torque /= scale_;
    const Vec3d p_TH_D = -(X_DH.linear() * X_HT_.translation());
    return wrench.about(p_TH_D);
  }

  /// Returns the stiffness at the hand [N/m] of a stiffness k in the world [N/m].
  [[nodiscard]] double device_stiffness(double k) const noexcept { return scale_ * k; }
  /// Returns the rotational stiffness at the hand [N·m/rad] of a rotational stiffness k in the world [N·m/rad].
  [[nodiscard]] double device_angular_stiffness(double k) const noexcept { return k / scale_; }

  [[nodiscard]] const Posed& X_WD() const noexcept { return X_WD_; }
  [[nodiscard]] const Posed& X_HT() const noexcept { return X_HT_; }
  [[nodiscard]] double scale() const noexcept { return scale_; }

 private:
  /// Largest entry of |RᵀR − I|: a rotation stored in single precision passes.
  static constexpr double kTolerance = 1e-6;

  static Posed checked(const Posed& X, const char* name) {
    const Mat3d R = X.linear();
    const double error = (R.transpose() * R - Mat3d::Identity()).cwiseAbs().maxCoeff();
    if (!is_finite(R) || !(error <= kTolerance) || !(R.determinant() > 0))
      refuse("Registration", std::string(name) + " must hold a rotation", R.format(Eigen::IOFormat(6, 0, " ", "; ")));
    const Vec3d p = X.translation();
    if (!is_finite(p)) refuse("Registration", std::string(name) + " must be finite", p.transpose());
    return make_pose(Mat3d(Quatd(R).normalized()), p);
  }

  Posed X_WD_ = Posed::Identity();
  Posed X_HT_ = Posed::Identity();
  double scale_ = 1.0;
};

}  // namespace trephine
