// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>
#include <trephine/stage/carver.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/tool/cutting_law.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace trephine {

/// Spindle speed in turns a minute, as radians a second.
[[nodiscard]] constexpr double rpm(double turns) noexcept { return turns * 2 * std::numbers::pi / 60; }

/// Cutting in one tick. Forces are true ones, before the device's share.
struct CuttingReport {
  Wrenchd edges;            ///< of the cutting edges, on the tool about T's origin, W axes [N, N·m]
  double thrust = 0;        ///< magnitude of the contact's force on the head [N]
  double torque = 0;        ///< of the bone about the spindle's axis [N·m]
  double spindle = 0;       ///< speed [rad/s]
  double feed = 0;          ///< speed at which the law lets the head advance [m/s]
  double removed_rate = 0;  ///< bone removed [mm³/s]
  double chip_work = 0;     ///< of the spindle on chips since the last reset [J]
  double edge_work = 0;     ///< of the spindle on edges that rub since the last reset [J]
};

/// Forces of cutting: torque about the spindle, pull sideways, and a feed that depends on the thrust.
/// \code
/// CuttingForce cutting({.edges = {.flutes = 8}, .speed = rpm(40'000)});
/// HapticScene scene{bone, 300, CoupledToolRenderer{MatchHead{}, CoupledOptions{}}, cutting, Milling{PressureCut{}}};
/// \endcode
/// *Thrust* is the contact's force, which the renderer computes. With a `PressureCut` bone recedes at the feed at which
/// the law's thrust (`CuttingLaw`) equals it. So contact carries what is not removed, and feeding takes force. A ledger
/// compares the law's volume with what cuts removed, so the feed is exact whatever the voxels.
///
/// *Torque and pull.* Each removed volume V deposits the work u s V (s: the bone's strength). The spindle takes it out
/// over the next `lag · speed` radians, as a torque about its axis and a pull against the teeth where they cut. So
/// ∫ torque dθ = u s V + the edges' own work. Smoothing and lag are by angle, so that a slow spindle has no
/// singularity.
///
/// *Spindle.* With a `stall_torque` its speed falls linearly with the torque; at stall the feed ends.
///
/// *Device.* The wrench gets `felt` times the edges' true wrench. The renderer's force counts as `felt` times the true
/// thrust. So a felt share of 1/60 lets a pen of 3 N drill as 180 N do.
///
/// Which part of the head cuts is sampled at `HeadElements` half a voxel ahead, toward the feed; densities a voxel
/// farther than cuts reach. T's z axis is the spindle. Works with every renderer and cut. Without PressureCut the feed
/// does not depend on the force. The edges' force is not conservative: the spindle feeds it.
/// Haptic thread; no allocation.
class CuttingForce {
 public:
  static constexpr bool kUsesTwist = false;

  struct Options {
    CuttingEdges edges{};
    double speed = rpm(30'000);                                     ///< of the spindle without load [rad/s]
    bool clockwise = true;                                          ///< teeth turn clockwise, seen from the handle
    double stall_torque = std::numeric_limits<double>::infinity();  ///< [N·m]
    double inertia = 1e-6;                                          ///< of spindle and tool [kg m²]
    BoneStrength strength{};
    CuttingLaw law{};
    double felt = 1;     ///< share of the true forces that the device gets, in (0, 1]
    double lag = 0.005;  ///< time in which the spindle takes out e⁻¹ of a deposit, at its speed without load [s]

    /// Throws std::invalid_argument.
    void validate() const {
      edges.validate();
      strength.validate();
      law.validate();
      if (!(speed > 0) || !std::isfinite(speed)) refuse("CuttingForce", "speed must be > 0 rad/s", speed);
      if (!(stall_torque > 0)) refuse("CuttingForce", "stall_torque must be > 0 N·m", stall_torque);
      if (!(inertia > 0) || !std::isfinite(inertia)) refuse("CuttingForce", "inertia must be > 0 kg m2", inertia);
      if (!(felt > 0) || !(felt <= 1)) refuse("CuttingForce", "felt must be in (0, 1]", felt);
      if (!(lag > 0) || !(lag <= 1)) refuse("CuttingForce", "lag must be in (0, 1] s", lag);
    }
  };

  /// Throws std::invalid_argument.
  explicit CuttingForce(const Options& options) : options_(options) { options_.validate(); }

  void validate() const { options_.validate(); }
  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options by valid ones, between ticks on the haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }
  /// Prepares for a tool's head. The scene calls it at its construction and after a change of tool; no allocation.
  template <class Head>
  void prepare(const Head& head) noexcept {
    const CuttingHead& cutting = head_of(head);
    elements_ = HeadElements(cutting);
    top_ = cutting.outline.z_high();
    radius_ = cutting.outline.largest_radius();
  }

  /// Cutting in the last tick.
  [[nodiscard]] const CuttingReport& report() const noexcept { return report_; }
  [[nodiscard]] const Engagement& engagement() const noexcept { return engagement_; }

  void reset() noexcept {
    deposit_.setZero();
    spindle_ = 0;
    ledger_mm3_ = 0;
    engagement_ = {};
    report_ = {};
  }

  /// Returns the fraction of the bone in the head that this tick's cuts remove. The scene calls it after contact,
  /// before its carvers. `renderer` has rendered this tick.
  template <VoxelDensity Density, class ContactRenderer>
  double engage(const VoxelGrid<Density>& bone, double isovalue, const ContactRenderer& renderer, double dt,
                bool spindle_on) noexcept {
    engagement_ = {};
    wanted_mm3_ = 0;
    thrust_ = 0;
    spindle_ = spindle_on ? (spindle_ > 0 || is_stalled_ ? spindle_ : options_.speed) : 0;
    is_stalled_ = is_stalled_ && spindle_on;
    const Posed X_GT = renderer.proxy_pose().template cast<double>();
    R_GT_ = X_GT.linear();
    const HeadContact contact = contact_of(renderer, X_GT);
    thrust_ = contact.force.norm() / options_.felt;
    if (!spindle_on || !(thrust_ > 0)) {
      ledger_mm3_ = 0;
      return 0;
    }
    const Vec3d feed_T = -(R_GT_.transpose() * contact.force).normalized();
    sample(bone, isovalue, X_GT, feed_T);
    const double x = options_.law.feed_under(thrust_, engagement_, options_.edges, radius_);
    feed_ = x * spindle_;
    wanted_mm3_ = feed_ * engagement_.area * dt * 1e9;
    if constexpr (requires {
                    renderer.foundation_law();
                    renderer.pressure_cutting_pose();
                  }) {
      // The head cuts ahead of the pose in which it presses.
      const Vec3d ahead = renderer.pressure_cutting_pose().translation().template cast<double>() - X_GT.translation();
      const double pressed_mm3 =
          1e9 * (contact.load / renderer.foundation_law().stiffness +
                 engagement_.facing_area * renderer.foundation_law().ramp / 2 + engagement_.area * ahead.norm());
      if (!(pressed_mm3 > 0)) return 0;
      ledger_mm3_ = std::clamp(ledger_mm3_ + wanted_mm3_, -pressed_mm3, pressed_mm3);
      return std::max(0.0, ledger_mm3_ / pressed_mm3);
    } else {
      return 1;
    }
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const double dt = context.dt;
    ledger_mm3_ -= context.removed_mm3;
    const CuttingLaw& law = options_.law;
    const Engagement& on = engagement_;
    // Work on chips, with the pattern of force where they are cut: by radian, torque along z.
    if (on.area > 0) {
      const double work_per_hard_area = law.energy * context.removed_mm3 * 1e-9 / on.area;
      deposit_.head<3>() += work_per_hard_area * on.around;
      deposit_.tail<3>() += work_per_hard_area * on.moment;
    }
    const double lag_angle = options_.lag * options_.speed, turn = spindle_ * dt;
    const double part = -std::expm1(-turn / lag_angle);
    const Vec6d chips = deposit_ * (turn > 0 ? part / turn : 1 / lag_angle);
    deposit_ *= 1 - part;
    // A stalled tool holds its chips until it is free.
    if (!(turn > 0) && !(on.area > 0)) deposit_.setZero();
    // The edges' own force, by the chips that the torque tells.
    const int z = options_.edges.count();
    const double x = on.hard_area > 0 ? chips[5] / (law.energy * on.hard_area) : 0;
    const double own = law.edges_around(x, z);
    Vec6d edges;
    edges << own * on.around, own * on.moment;
    Vec6d total = chips + edges;
    advance_spindle(total[5], dt);
    if (is_stalled_) total *= std::min(1.0, options_.stall_torque / total[5]);

    const Mat3d R_WT = context.X_WG.linear() * R_GT_;
    const double against_teeth = options_.clockwise ? 1 : -1;
    report_.edges = {R_WT * Vec3d(against_teeth * total.head<3>()), R_WT * Vec3d(against_teeth * total.tail<3>())};
    report_.thrust = thrust_;
    report_.torque = total[5];
    report_.spindle = spindle_;
    report_.feed = feed_;
    report_.removed_rate = context.removed_mm3 / dt;
    report_.chip_work += chips[5] * turn;
    report_.edge_work += edges[5] * turn;
    wrench += options_.felt * report_.edges;
  }

 private:
  struct HeadContact {
    Vec3d force = Vec3d::Zero();  // on the head, in G [N]
    double load = 0;              // sum of the normal forces [N]
  };

  template <class ContactRenderer>
  [[nodiscard]] HeadContact contact_of(const ContactRenderer& renderer, const Posed& X_GT) const noexcept {
    HeadContact sum;
    const Vec3d axis = X_GT.linear().col(2);
    for (const auto& c : renderer.contacts()) {
      const Vec3d force = c.force.template cast<double>();
      if (axis.dot(c.position.template cast<double>() - X_GT.translation()) > top_) continue;
      sum.force += force;
      sum.load += force.dot(c.normal.template cast<double>());
    }
    return sum;
  }

  /// Samples the bone ahead of the head's elements.
  template <VoxelDensity Density>
  void sample(const VoxelGrid<Density>& bone, double isovalue, const Posed& X_GT, const Vec3d& feed_T) noexcept {
    constexpr auto kCount = static_cast<int>(HeadElements::kCount);
    static_assert(HeadElements::kCount % kLane == 0);
    const DensityField<Density, float> field(bone, isovalue);
    const Pose<float> X = X_GT.template cast<float>();
    const double h = bone.spacing().minCoeff();
    const auto near = Vec3<float>((kLead * h * feed_T).template cast<float>());
    const auto far = static_cast<float>(cut_reach(bone.spacing()) + bone.spacing().norm());
    HeadElements::Numbers x, y, z, engaged, beyond;
    for (std::size_t i = 0; i < HeadElements::kCount; ++i) {
      x[i] = elements_.x[i] + near.x();
      y[i] = elements_.y[i] + near.y();
      z[i] = elements_.z[i] + near.z();
    }
    field.values(X, x.data(), y.data(), z.data(), engaged.data(), kCount);
    for (std::size_t i = 0; i < HeadElements::kCount; ++i) {
      x[i] = elements_.x[i] + far * elements_.normal_x[i];
      y[i] = elements_.y[i] + far * elements_.normal_y[i];
      z[i] = elements_.z[i] + far * elements_.normal_z[i];
    }
    field.values(X, x.data(), y.data(), z.data(), beyond.data(), kCount);
    // Beside a cut the density rises by the cut's slope.
    const auto whole = static_cast<float>(kLead / 4 * slope_or_auto(0, bone, isovalue));
    for (std::size_t i = 0; i < HeadElements::kCount; ++i) {
      const float density = std::max(engaged[i], beyond[i]);
      engaged[i] = std::clamp(engaged[i] / whole, 0.0F, 1.0F);
      beyond[i] = static_cast<float>(options_.strength(isovalue + static_cast<double>(density)));
    }
    engagement_ = engagement_of(elements_, feed_T, engaged, beyond);
  }

  /// J dω/dt = drive − torque, the drive falling from the stall torque to 0 at the speed without load.
  void advance_spindle(double torque, double dt) noexcept {
    if (!(spindle_ > 0) && !is_stalled_) return;
    if (!std::isfinite(options_.stall_torque)) return;
    const double J = options_.inertia / dt;
    spindle_ =
        std::max(0.0, (J * spindle_ + options_.stall_torque - torque) / (J + options_.stall_torque / options_.speed));
    is_stalled_ = !(spindle_ > 0);
  }

  static constexpr double kLead = 0.5;  // [voxels]

  Options options_;
  HeadElements elements_;
  double top_ = std::numeric_limits<double>::infinity();  // of the head, in T [m]
  double radius_ = 0;                                     // [m]

  // State from tick to tick.
  Vec6d deposit_ = Vec6d::Zero();  // work on chips not yet taken out: force and torque times radians, T axes
  double spindle_ = 0;             // [rad/s]
  bool is_stalled_ = false;
  double ledger_mm3_ = 0;  // the law's volume less the removed

  // Of this tick.
  Engagement engagement_;
  Mat3d R_GT_ = Mat3d::Identity();
  double thrust_ = 0, feed_ = 0, wanted_mm3_ = 0;
  CuttingReport report_;
};

}  // namespace trephine
