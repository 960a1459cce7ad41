// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/wrench.hpp>

#include <cmath>

namespace trephine {

/// How a device's workspace lies in the world: a similarity. The tool point T is fixed to the handle at `X_HT` (handle
/// frame H, real metres at the hand); what it does in the device's base frame D appears in the world turned and moved
/// by `X_WD` and enlarged by `scale` about D's origin:
///
///     X_DT = X_DH * X_HT,   p_WT = X_WD * (scale * p_DT),   R_WT = R_WD * R_DT.
///
/// A scale below 1 is fine work: the hand moves 1 m, the drill `scale` metres; angles are not scaled.
///
/// The force comes back as it is, turned into D. Then energy at the hand is energy in the world divided by `scale`, and
/// for that to hold in rotation too (a law with a potential keeps one, so that no closed path of the hand makes energy)
/// the free torque about T is divided by `scale`, as if the hand held an enlarged world, whose lever arms are longer:
///
///     f_D = R_DW f_W,   τ_H = R_DW τ_T / scale + p_HT_D × f_D,   power at the hand = power in the world / scale.
///
/// So a stiffness k [N/m] of the world is felt as scale · k, a rotational one [N·m/rad] as k / scale.
/// Immutable; all members are safe from any thread and do not allocate.
class Registration {
 public:
  /// World, device and tool frames coincide.
  Registration() = default;

  /// Throws std::invalid_argument unless poses are finite, their linear parts rotations (to 1e-6; they are then made
  /// orthonormal to rounding), and scale > 0 and finite.
  explicit Registration(const Posed& X_WD, const Posed& X_HT = Posed::Identity(), double scale = 1.0)
      : X_WD_(checked(X_WD, "X_WD")), X_HT_(checked(X_HT, "X_HT")), scale_(scale) {
    if (!(scale > 0) || !std::isfinite(scale)) refuse("Registration", "scale must be > 0 and finite", scale);
  }

  /// X_WT for a handle at X_DH.
  [[nodiscard]] Posed tool_pose(const Posed& X_DH) const noexcept {
    const Mat3d R_DH = X_DH.linear(), R_WD = X_WD_.linear();
    const Vec3d p_DT = R_DH * X_HT_.translation() + X_DH.translation();
    return make_pose(Mat3d(R_WD * Mat3d(R_DH * X_HT_.linear())),
                     Vec3d(R_WD * Vec3d(scale_ * p_DT) + X_WD_.translation()));
  }

  /// The inverse: where the handle must be for the tool to be at X_WT. For scripting a hand along a path of the world.
  [[nodiscard]] Posed handle_pose(const Posed& X_WT) const noexcept {
    const Mat3d R_DW = inverse_rotation(X_WD_), R_DT = R_DW * X_WT.linear();
    const Vec3d p_DT = R_DW * Vec3d((X_WT.translation() - X_WD_.translation()) / scale_);
    const Mat3d R_DH = R_DT * inverse_rotation(X_HT_);
    return make_pose(R_DH, Vec3d(p_DT - R_DH * X_HT_.translation()));
  }

  /// The wrench about H in D axes that the hand must feel for `wrench_T_W` (about T, W axes) with the handle at X_DH.
  [[nodiscard]] Wrenchd device_wrench(const Wrenchd& wrench_T_W, const Posed& X_DH) const noexcept {
    const Mat3d R_DW = inverse_rotation(X_WD_);
    Wrenchd wrench = wrench_T_W.rotated(R_DW);
    wrench.torque /= scale_;
    const Vec3d p_TH_D = -(X_DH.linear() * X_HT_.translation());
    return wrench.about(p_TH_D);
  }

  /// Stiffness at the hand of a stiffness k of the world [N/m].
  [[nodiscard]] double felt_stiffness(double k) const noexcept { return scale_ * k; }
  /// Rotational stiffness at the hand of one of the world [N·m/rad].
  [[nodiscard]] double felt_angular_stiffness(double k) const noexcept { return k / scale_; }

  [[nodiscard]] const Posed& X_WD() const noexcept { return X_WD_; }
  [[nodiscard]] const Posed& X_HT() const noexcept { return X_HT_; }
  [[nodiscard]] double scale() const noexcept { return scale_; }

 private:
  static Posed checked(const Posed& X, const char* name) {
    constexpr double kTolerance = 1e-6;  // room for a rotation that was stored in single precision
    const Mat3d R = X.linear();
    const double error = (R.transpose() * R - Mat3d::Identity()).cwiseAbs().maxCoeff();
    if (!R.allFinite() || !(error <= kTolerance) || !(R.determinant() > 0))
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
