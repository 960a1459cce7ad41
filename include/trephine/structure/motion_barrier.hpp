// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/core/wrench.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/structure/tool_distance.hpp>
#include <trephine/tool/shape.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Largest speed of any point of a burr, ball and shaft, whose axis points along `axis` [m/s].
[[nodiscard]] inline double largest_speed(const Burr& burr, const Vec3d& axis, const Twist& v) noexcept {
  const double turn = v.angular.norm();
  const double tip = v.linear.norm() + turn * std::max(burr.tip_radius, burr.has_shaft() ? burr.shaft_radius : 0.0);
  if (!burr.has_shaft()) return tip;
  const Vec3d end = v.linear + burr.shaft_length * v.angular.cross(axis);
  return std::max(tip, end.norm() + turn * burr.shaft_radius);
}

/// Largest distance between the two places of any point of a burr at two poses [m], to a bound: a ball's radius counts
/// in full for the turn.
[[nodiscard]] inline double largest_displacement(const Burr& burr, const Posed& X, const Posed& Y) noexcept {
  const Mat3d turn = Y.linear() - X.linear();
  const double chord = turn.norm() / std::sqrt(2.0);  // 2 sin(θ/2): the largest |turn q| of a unit vector q
  const Vec3d shift = Y.translation() - X.translation();
  const double tip = shift.norm() + chord * std::max(burr.tip_radius, burr.has_shaft() ? burr.shaft_radius : 0.0);
  if (!burr.has_shaft()) return tip;
  const Vec3d end = shift + burr.shaft_length * (z_axis(Y) - z_axis(X));
  return std::max(tip, end.norm() + chord * burr.shaft_radius);
}

/// Returns the pose after dt [s] of a twist. Without a turn, the rotation's bits stay.
[[nodiscard]] inline Posed pose_after(const Posed& X, const Twist& v, double dt) noexcept {
  Posed Y = X;
  Y.translation() += dt * v.linear;
  if (!(v.angular.squaredNorm() > 0)) return Y;
  const Quatd q(product(rotation_from_vector<double>(dt * v.angular), Mat3d(X.linear())));
  Y.linear() = q.normalized().toRotationMatrix();
  return Y;
}

/// Options of a `MotionBarrier`.
struct MotionBarrierOptions {
  double margin = 1e-3;  ///< that the moving tool keeps from every structure of the field [m], >= 0
  double speed = 0.03;   ///< V: largest speed of any point of the tool [m/s], > 0
  double lag = 0.02;     ///< L: time by which the robot trails its command at most, periods and delays included [s]
  double rate = 20;      ///< α: the clearance shrinks by this share a second at most [1/s], > 0
  /// Turn that a correction makes for a shift, per lever [1/m²], >= 0: the robot's rotational admittance over its
  /// translational one. 0 only shifts the tool.
  double turn = 400;

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    const auto check_value = [](const char* rule, double v, bool is_ok) {
      if (!is_ok || !is_finite(v)) refuse("MotionBarrier", rule, v);
    };
    check_value("margin must be 0 to 0.05 m", margin, margin >= 0 && margin <= 0.05);
    check_value("speed must be > 0 and at most 1 m/s", speed, speed > 0 && speed <= kHandSpeed);
    check_value("lag must be 0 to 0.1 s", lag, lag >= 0 && lag <= kLongestDt);
    check_value("rate must be > 0 1/s", rate, rate > 0);
    check_value("turn must be >= 0 1/m²", turn, turn >= 0);
  }
};

/// A step of motion that a barrier allows.
struct AllowedMotion {
  Twist twist;                     ///< of T in W
  Posed X_WT = Posed::Identity();  ///< the pose that it leads to in `dt`: the next command
  double distance = 0;             ///< of the whole tool there from the nearest structure [m]
  int structure = -1;              ///< that structure; -1 for a pose that is not usable, which does not move
  bool limited = false;            ///< a structure changed the twist that was wanted; V alone does not count
};

/// A hard limit on commanded motion: the whole tool, shaft included, keeps a clearance c from every structure of a
/// field. With d the tool's distance at the commanded pose X, the next one has
///   d' − c >= (1 − α dt) (d − c)   if d >= c,   and   d' >= d   if d < c,
/// so a command that starts outside of the clearance never enters it, and one that starts inside only leaves.
///
/// Both are checked at the pose that the step leads to, so they hold for any rotation and any shape of the structures.
/// A twist that breaks them is corrected along the gradient at the tool's nearest point, which lets the tool slide. If
/// that does not succeed the twist is shortened, and at last it is zero, which keeps d.
///
/// The robot itself: no point of the tool is commanded faster than V, so a robot that trails by at most L is at most
/// V L from its command. A field's distances at two places differ by at most the displacement and `slack()`. Hence
///   c = margin + V L + slack
/// keeps the moving tool at least `margin` away, at and between ticks. The field's own error comes on top.
///
/// List only structures to be kept out of in the field. Any thread; no memory. Cost: 2 tool distances, at most 13.
class MotionBarrier {
 public:
  /// `X_WS` is the pose of the field's frame. Pass a tool that is no burr as its `holding_burr`. Throws
  /// std::invalid_argument without a field or for what `validate` refuses.
  MotionBarrier(std::shared_ptr<const StructureField> field, const Posed& X_WS, const Burr& burr,
                const MotionBarrierOptions& options = {})
      : field_(std::move(field)), X_SW_(inverse(X_WS)), burr_(burr), options_(options) {
    if (field_ == nullptr) refuse("MotionBarrier", "it needs a StructureField", "none");
    burr_.validate();
    options_.validate();
  }

  [[nodiscard]] const MotionBarrierOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  /// Returns c, the least distance of a commanded pose that starts beyond it [m].
  [[nodiscard]] double clearance() const noexcept {
    return options_.margin + options_.speed * options_.lag + field_->slack();
  }
  /// Returns the tool's distance from the nearest structure at a pose.
  [[nodiscard]] ToolDistance distance(const Posed& X_WT) const noexcept {
    return tool_distance(*field_, burr_, compose(X_SW_, X_WT));
  }

  /// Returns the motion nearest to `wanted` that is found for a step of dt [s] from the commanded pose X_WT. Twists
  /// that are not finite count as zero, and dt is clamped as a tick's.
  [[nodiscard]] AllowedMotion limit(const Posed& X_WT, const Twist& wanted, double dt) const noexcept {
    AllowedMotion out;
    out.X_WT = X_WT;
    if (!is_usable_pose(X_WT)) return out;
    const ToolDistance now = distance(X_WT);
    if (now.structure < 0) return out;
    dt = clamped_dt(dt);
    const double c = clearance(), spare = now.distance - c;
    const double floor = spare >= 0 ? c + std::max(1 - options_.rate * dt, 0.0) * spare : now.distance;
    if (is_finite(wanted.linear) && is_finite(wanted.angular)) out.twist = wanted;
    ToolDistance next;
    for (int n = 0; n <= kCorrections; ++n) {
      slow_down(z_axis(X_WT), out.twist);
      if (try_step(X_WT, dt, floor, next, out)) return out;
      out.limited = true;
      correct(next, (floor - next.distance + kBeyond) / dt, out);
    }
    for (int n = 0; n < kHalvings; ++n) {
      out.twist = {out.twist.linear / 2, out.twist.angular / 2};
      slow_down(z_axis(X_WT), out.twist);
      if (try_step(X_WT, dt, floor, next, out)) return out;
    }
    out.twist = {};
    (void)try_step(X_WT, dt, floor, next, out);
    return out;
  }

 private:
  static constexpr int kCorrections = 4;   // a corner of three structures takes three
  static constexpr int kHalvings = 6;      // a motion 64 times slower is not felt
  static constexpr double kBeyond = 1e-8;  // [m] beyond the floor that corrections aim for: more than rounding

  void slow_down(const Vec3d& axis, Twist& v) const noexcept {
    const double speed = largest_speed(burr_, axis, v);
    if (speed > options_.speed) v = {v.linear * (options_.speed / speed), v.angular * (options_.speed / speed)};
  }

  /// Makes the step of `out.twist`. Returns true if the tool is then at the floor or beyond.
  bool try_step(const Posed& X_WT, double dt, double floor, ToolDistance& next, AllowedMotion& out) const noexcept {
    out.X_WT = pose_after(X_WT, out.twist, dt);
    next = distance(out.X_WT);
    out.distance = next.distance;
    out.structure = next.structure;
    return next.structure >= 0 && next.distance >= floor;
  }

  /// Adds the twist that a push on the tool's nearest point makes, of `speed` [m/s] at that point.
  void correct(const ToolDistance& nearest, double speed, AllowedMotion& out) const noexcept {
    const Mat3d R_WS = inverse_rotation(X_SW_);
    const Vec3d n = product(R_WS, nearest.direction_S);
    const Vec3d p_WQ = product(R_WS, Vec3d(nearest.p_S - X_SW_.translation()));
    const Vec3d lever = Vec3d(p_WQ - out.X_WT.translation()).cross(n);
    const double push = speed / (1 + options_.turn * lever.squaredNorm());
    out.twist.linear += push * n;
    out.twist.angular += options_.turn * push * lever;
  }

  std::shared_ptr<const StructureField> field_;
  Posed X_SW_;
  Burr burr_;
  MotionBarrierOptions options_;
};

}  // namespace trephine
