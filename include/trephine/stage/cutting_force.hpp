// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/cutting_force_options.hpp>
#include <trephine/stage/cutting_part.hpp>
#include <trephine/stage/head_samples.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/tool/cutting_law.hpp>
#include <trephine/tool/engagement.hpp>
#include <trephine/voxel/tissue_cut.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Cutting in one tick. Forces are true ones, before the device's share.
struct CuttingReport {
  Wrenchd edges;            ///< of the cutting edges, on the tool about T's origin, W axes [N, N·m]
  double thrust = 0;        ///< magnitude of the contact's force on the head; of a drill along its axis [N]
  double torque = 0;        ///< of the bone about the spindle's axis [N·m]
  double spindle = 0;       ///< speed [rad/s]
  double feed = 0;          ///< speed at which the law lets the head advance, at most kMaxSpeed [m/s]
  double removed_rate = 0;  ///< bone removed [mm³/s]
  double chip_work = 0;     ///< of the spindle on chips since the last reset [J]
  double edge_work = 0;     ///< of the spindle on edges that rub since the last reset [J]
};

/// A law of cutting for a `Cutting`: torque about the spindle, pull sideways, and a feed that depends on the thrust.
/// \code
/// CuttingForce law({.edges = {.flutes = 8}, .speed = rpm(40'000)});
/// HapticScene scene{bone, 300, CoupledToolRenderer{MatchHead{}}, Cutting{PressureCut{}, law}};
/// \endcode
/// *Thrust* is the contact's force, which the renderer computes. With a `PressureCut` bone recedes at the feed at which
/// the law's thrust (`CuttingLaw`) equals it. So contact carries what is not removed, and feeding takes force. A ledger
/// compares the law's volume with what cuts removed, so the feed is exact whatever the voxels.
///
/// *Torque and pull.* Each removed volume V deposits the work u s V (s: the bone's strength). The spindle takes it out
/// over the next `lag · speed` radians, as a torque about its axis and a pull against the teeth where they cut. So
/// ∫ torque dθ = u s V + the edges' own work. Smoothing and lag are by angle, so that a slow spindle has no
/// singularity. The pull is no more than the law lets the thrust's feed pull, so it ends where the thrust ends.
///
/// *Spindle.* With a `stall_torque` its speed falls linearly with the torque; at stall the feed ends.
///
/// *Device.* The wrench gets `force_scale` times the edges' true wrench. The renderer's force counts as `force_scale`
/// times the true thrust. So a scale of 1/60 lets a pen of 3 N drill as 180 N do.
///
/// `HeadSamples` tells which part of the head cuts, and what. T's z axis is the spindle. Works with every renderer and
/// cut. Without PressureCut the feed does not depend on the force. The edges' force is not conservative: the spindle
/// feeds it. Haptic thread; no allocation.
class CuttingForce {
 public:
  static constexpr bool kUsesTwist = false;

  using Options = CuttingForceOptions;

  /// `tissues`: bone is stronger by 1/rate where the map's rate is below 1 (`make_tissue_map`, structure/tissues.hpp).
  /// So cut with a plain `PressureCut`, not a `TissueCut` of it. Copies share the map. Throws std::invalid_argument.
  explicit CuttingForce(const Options& options, std::shared_ptr<const TissueMap> tissues = nullptr)
      : options_(options), tissues_(std::move(tissues)) {
    options_.validate();
  }

  void validate() const { options_.validate(); }
  /// Throws std::invalid_argument if the tissues' map was made for another grid.
  template <VoxelDensity Density>
  void validate_for(const VoxelGrid<Density>& bone, double /*isovalue*/) const {
    if (tissues_ != nullptr && !tissues_->fits(bone))
      refuse("CuttingForce", "the map of tissues must be made for a bone of the scene's size", "another");
  }
  [[nodiscard]] const Options& options() const noexcept { return options_; }
  /// Replaces the options by valid ones, between ticks on the haptic thread.
  void adopt(const Options& options) noexcept { options_ = options; }
  /// Prepares for a tool's head. The scene calls it at its construction and after a change of tool; no allocation.
  template <class Head>
  void prepare(const Head& head) noexcept {
    const ToolOutline& outline = outline_of(head);
    elements_ = HeadElements(outline);
    HeadElements::Numbers one;
    one.fill(1);
    const Engagement whole = engagement_of(elements_, -Vec3d::UnitZ(), one, one);
    const double share = 1.0 / HeadElements::kCount;
    least_ = {.area = share * whole.area,
              .hard_area = share * whole.hard_area,
              .facing_area = share * whole.facing_area,
              .pressed = share * whole.pressed,
              .edge = share * whole.edge,
              .moment = {0, 0, share * whole.hard_area}};
    top_ = outline.z_high();
    radius_ = outline.largest_radius();
  }

  /// Cutting in the last tick.
  [[nodiscard]] const CuttingReport& report() const noexcept { return report_; }
  [[nodiscard]] const Engagement& engagement() const noexcept { return engagement_; }
  /// Writes the true forces of the last tick, which the scene's `TickResult::cutting` has.
  void add_to(CuttingSummary& summary) const noexcept {
    summary = {report_.thrust, report_.torque, report_.spindle, report_.feed};
  }

  void reset() noexcept {
    deposit_.setZero();
    pattern_.setZero();
    spindle_ = 0;
    ledger_mm3_ = 0;
    engagement_ = {};
    report_ = {};
  }

  /// Returns what this tick's cuts may remove. Called after contact, before the cut. `renderer` has rendered this
  /// tick.
  template <VoxelDensity Density, class ContactRenderer>
  PressedCut engage(const VoxelGrid<Density>& bone, double isovalue, const ContactRenderer& renderer, double dt,
                    bool spindle_on) noexcept {
    engagement_ = {};
    feed_ = advance_ = 0;
    spindle_ = spindle_on ? (spindle_ > 0 || is_stalled_ ? spindle_ : options_.speed) : 0;
    is_stalled_ = is_stalled_ && spindle_on;
    const Posed X_GT = renderer.proxy_pose().template cast<double>();
    R_GT_ = X_GT.linear();
    Vec3d force = force_on_head(renderer, X_GT);
    // A drill cuts along its axis alone: its margins guide it in the hole.
    if (options_.edges.chisel) force = std::max(0.0, R_GT_.col(2).dot(force)) * R_GT_.col(2);
    thrust_ = force.norm() / options_.force_scale;
    if (!spindle_on || !(thrust_ > 0)) {
      ledger_mm3_ = 0;
      return {0, 0};
    }
    const Vec3d feed_T = -(R_GT_.transpose() * force).normalized();
    engagement_ = HeadSamples(elements_, bone, isovalue, X_GT, feed_T).engagement(options_.strength, tissues_.get());
    if (!(engagement_.area > least_.area)) engagement_ = least_;
    const Engagement& on = engagement_;
    // What has no strength does not hold the head.
    const bool holds = on.pressed > 0;
    advance_ = options_.law.feed_under(thrust_, on, options_.edges, radius_);
    feed_ = holds ? advance_ * spindle_ : kMaxSpeed;
    feed_ = spindle_ > 0 ? std::min(feed_, kMaxSpeed) : 0;
    if constexpr (CutsByPressure<ContactRenderer>) {
      const double travel = feed_ * dt;
      // What earlier ticks could not remove, as a distance: voxels do not hold the shape of every rim, and where they
      // leave bone inside it, a cut must go ahead until the tool is free.
      ledger_mm3_ += 1e9 * travel * on.area;
      const double behind = std::max(0.0, ledger_mm3_ / (1e9 * on.area) - travel);
      const double reach = travel + kCatchUp * behind;
      // Bone in the head where it cuts, ahead of where it presses. It need not be exact: the ledger corrects it.
      const auto& foundation = renderer.foundation_law();
      const Vec3d ahead =
          renderer.pressure_cutting_pose(reach).translation().template cast<double>() - X_GT.translation();
      const double load = force.norm() * on.facing_area / on.area;
      const double pressed_mm3 =
          1e9 * (load / foundation.stiffness + on.facing_area * foundation.ramp / 2 + on.area * ahead.norm());
      ledger_mm3_ = std::clamp(ledger_mm3_, -pressed_mm3, pressed_mm3);
      return {std::max(0.0, ledger_mm3_ / pressed_mm3), reach};
    } else {
      return {};
    }
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    const double dt = context.dt;
    ledger_mm3_ -= context.removed_mm3;
    const CuttingLaw& law = options_.law;
    const Engagement& on = engagement_;
    // Work on chips, with the pattern of force where they are cut: by radian, torque along z. A cut that runs ahead of
    // contact has the pattern of the last contact.
    if (on.area > 0) pattern_ << on.around / on.area, on.moment / on.area;
    deposit_ += law.energy * context.removed_mm3 * 1e-9 * pattern_;
    const double lag_angle = options_.lag * options_.speed, turn = spindle_ * dt;
    // A stalled tool holds its chips until it is free, a stopped one drops them.
    if (!(turn > 0) && !(on.area > 0)) deposit_.setZero();
    const double part = -std::expm1(-turn / lag_angle);
    const Vec6d chips = deposit_ * (turn > 0 ? part / turn : 1 / lag_angle);
    deposit_ *= 1 - part;
    // The edges' own force, by the chips that the torque tells.
    const double x = on.hard_area > 0 ? chips[5] / (law.energy * on.hard_area) : 0;
    const double own = law.edges_around(x, options_.edges);
    Vec6d edges;
    edges << own * on.around, own * on.moment;
    Vec6d total = chips + edges;
    // Chips of earlier turns pull where the edges are now by no more than the thrust lets these pull.
    const double pull = linear_part(total).norm(), most = law.most_pull(advance_, on, options_.edges);
    if (pull > most)
      for (Eigen::Index i = 0; i < 5; ++i) total[i] *= most / pull;
    advance_spindle(total[5], dt);
    if (is_stalled_) total *= std::min(1.0, options_.stall_torque / total[5]);

    const Mat3d R_WT = context.X_WG.linear() * R_GT_;
    const double against_teeth = options_.clockwise ? 1 : -1;
    report_.edges = {R_WT * Vec3d(against_teeth * linear_part(total)),
                     R_WT * Vec3d(against_teeth * angular_part(total))};
    report_.thrust = thrust_;
    report_.torque = total[5];
    report_.spindle = spindle_;
    report_.feed = feed_;
    report_.removed_rate = context.removed_mm3 / dt;
    report_.chip_work += chips[5] * turn;
    report_.edge_work += edges[5] * turn;
    wrench += options_.force_scale * report_.edges;
  }

 private:
  /// Sum of the contact forces below the head's upper end, in G [N].
  template <class ContactRenderer>
  [[nodiscard]] Vec3d force_on_head(const ContactRenderer& renderer, const Posed& X_GT) const noexcept {
    Vec3d sum = Vec3d::Zero();
    const Vec3d axis = z_axis(X_GT);
    const double top = top_ + axis.dot(X_GT.translation());
    for (const auto& c : renderer.contacts())
      if (axis.dot(c.position.template cast<double>()) <= top) sum += c.force.template cast<double>();
    // A large head, pressed all over, has more contacts than a list: its shaft then has few.
    if constexpr (HasUnlistedForce<ContactRenderer>) sum += renderer.unlisted_force();
    return sum;
  }

  /// J dω/dt = drive − torque, the drive falling from the stall torque to 0 at the speed without load.
  void advance_spindle(double torque, double dt) noexcept {
    if (!(spindle_ > 0) && !is_stalled_) return;
    if (!is_finite(options_.stall_torque)) return;
    const double J = options_.inertia / dt;
    spindle_ =
        std::max(0.0, (J * spindle_ + options_.stall_torque - torque) / (J + options_.stall_torque / options_.speed));
    is_stalled_ = !(spindle_ > 0);
  }

  // By which a cut goes ahead for each metre of feed that it could not take. A rim is then free within 20 µm of feed.
  static constexpr double kCatchUp = 10;

  Options options_;
  std::shared_ptr<const TissueMap> tissues_;
  HeadElements elements_;
  // Bone that presses on the head counts as much as one element at least, which may have missed it. So what touches a
  // head lightly is not cut at once.
  Engagement least_;
  double top_ = std::numeric_limits<double>::infinity();  // of the head, in T [m]
  double radius_ = 0;                                     // [m]

  // State from tick to tick.
  Vec6d deposit_ = Vec6d::Zero();  // work on chips not yet taken out: force and torque times radians, T axes
  Vec6d pattern_ = Vec6d::Zero();  // of the last engagement: around and moment by area
  double spindle_ = 0;             // [rad/s]
  bool is_stalled_ = false;
  double ledger_mm3_ = 0;  // the law's volume less the removed

  // Of this tick.
  Engagement engagement_;
  Mat3d R_GT_ = Mat3d::Identity();
  double thrust_ = 0, feed_ = 0;
  double advance_ = 0;  // that the thrust allows [m a radian]
  CuttingReport report_;
};

}  // namespace trephine
