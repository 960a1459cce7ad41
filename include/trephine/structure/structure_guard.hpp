// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/context.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/guard_potential.hpp>
#include <trephine/structure/tool_distance.hpp>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Output of a guard in one tick.
struct GuardReport {
  Wrenchd push;          ///< on the tool, about T's origin, in W axes; part of the tick's wrench
  double energy = 0;     ///< of the push [J], at its present share
  double share = 0;      ///< of the push that acts: 0 when switched on, 1 after the ramp
  double depth = 0;      ///< of the deepest ball of the tool in a margin [m]; 0 outside of all margins
  int structure = -1;    ///< in whose margin that ball is; -1 outside of all
  ToolDistance nearest;  ///< of the whole tool at the device's pose to any structure, in S
  bool warns = false;    ///< the nearest structure is guarded and nearer than its margin
};

/// A stage that pushes the tool out of the margins of structures: the force of a GuardPotential, with damping.
/// \code
/// auto potential = std::make_shared<const GuardPotential>(field, X_GS, burr, structures);
/// HapticScene{bone, 300, renderer, Cutting{...}, StructureGuard{potential}, DeviceLimits{.force = 3.3}};
/// \endcode
/// It acts on the device's pose, so the push is conservative in what the hand does, with every renderer. Its stiffness
/// adds to the contact's. Damping acts on motion toward a structure and grows from 0 at the margin's border. It never
/// pulls: the push of a ball on its structure is at least 0.
///
/// The push fades in and out over `ramp_time` if the tool is in a margin when the guard is switched, at the first tick,
/// and after a jump or a reset. A switch outside of all margins takes effect at once.
///
/// Haptic thread; allocates at construction only. Change options between ticks or through `Remote<StructureGuard>`.
class StructureGuard {
 public:
  using Options = GuardOptions;

  /// Throws std::invalid_argument without a potential or if an option is out of range.
  explicit StructureGuard(std::shared_ptr<const GuardPotential> potential, const Options& options)
      : potential_(std::move(potential)), options_(options) {
    if (potential_ == nullptr) refuse("StructureGuard", "it needs a GuardPotential", "none");
    validate();
    pushes_.resize(potential_->most_pushes());
    probes_.resize(potential_->most_probes());
    loads_.resize(potential_->structures().size());
    breaches_.resize(loads_.size());
    X_SG_ = inverse(potential_->X_GS());
  }
  explicit StructureGuard(std::shared_ptr<const GuardPotential> potential)
      : StructureGuard(std::move(potential), Options{}) {}

  void validate() const { options_.validate(); }
  [[nodiscard]] const Options& options() const noexcept { return options_; }
  void adopt(const Options& options) noexcept { options_ = options; }
  [[nodiscard]] const GuardPotential& potential() const noexcept { return *potential_; }
  [[nodiscard]] const GuardReport& report() const noexcept { return report_; }

  /// Returns how often the tool went into a structure that is guarded, at the device's pose. The next time counts once
  /// the tool has left all structures by `StructureField::slack`. 0 for a number that is none.
  [[nodiscard]] int breaches(int structure) const noexcept {
    return structure >= 0 && static_cast<std::size_t>(structure) < breaches_.size()
               ? breaches_[static_cast<std::size_t>(structure)].count
               : 0;
  }
  /// Forgets breaches.
  void reset_counts() noexcept { std::fill(breaches_.begin(), breaches_.end(), Breach{}); }

  /// Adds the last tick's push, and its distance if it is the least of several guards. Structures are numbered as in
  /// the guard's own field.
  void add_to(StructureSummary& summary) const noexcept {
    summary.push += report_.push;
    summary.warns = summary.warns || report_.warns;
    if (report_.nearest.structure < 0 || !(report_.nearest.distance < summary.distance)) return;
    summary.nearest = report_.nearest.structure;
    summary.distance = report_.nearest.distance;
  }

  void reset() noexcept {
    share_ = 0;
    report_ = {};
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    report_ = {};
    const Posed X_ST = X_SG_ * relative_pose(context.X_WG, context.input.X_WT);
    const GuardPotential::Found found = potential_->find(X_ST, pushes_, probes_);
    const std::span<const GuardPotential::Push> pushes(pushes_.data(), found.pushes);
    const double energy = potential_->energy(pushes, loads_);
    advance(context, energy > 0);
    report_.share = share_;
    report_.nearest = tool_distance(potential_->field(), potential_->burr(), X_ST, {probes_.data(), found.probes});
    if (report_.nearest.structure >= 0) {
      const GuardedStructure& s = potential_->structures()[static_cast<std::size_t>(report_.nearest.structure)];
      report_.warns = s.mode != GuardMode::kOff && report_.nearest.distance < s.margin;
      note_breach(s.mode != GuardMode::kOff);
    }
    if (pushes.empty()) return;

    const Mat3d R_WS = context.X_WG.linear() * potential_->X_GS().linear();
    const Vec3d v_S = R_WS.transpose() * context.twist_to_bone.linear;
    const Vec3d w_S = R_WS.transpose() * context.twist_to_bone.angular;
    const Vec3d axis = z_axis(X_ST);
    Wrenchd push_S = Wrenchd::zero();
    for (const GuardPotential::Push& p : pushes) {
      const GuardedStructure& s = potential_->structures()[static_cast<std::size_t>(p.structure)];
      const GuardPotential::Load& load = loads_[static_cast<std::size_t>(p.structure)];
      const double powered = p.powered();
      const double spring = load.per_u3 * powered / p.depth;
      const Vec3d arm = p.z * axis;
      const double approach = -p.gradient.dot(v_S + w_S.cross(arm));
      // The ball's share of its structure's push: damping of all balls together is the structure's.
      const double force = std::max(spring + damping(s, p, powered / load.powered, approach), 0.0);
      const Vec3d f = force * p.gradient;
      push_S.force += f;
      push_S.torque += arm.cross(f);
      if (p.depth > report_.depth) {
        report_.depth = p.depth;
        report_.structure = p.structure;
      }
    }
    report_.push = share_ * push_S.rotated(R_WS);
    report_.energy = share_ * energy;
    wrench += report_.push;
  }

 private:
  /// How often the tool went into a structure, and whether it has been out of all since.
  struct Breach {
    int count = 0;
    bool open = false;
  };

  void note_breach(bool guarded) noexcept {
    if (report_.nearest.distance < 0) {
      Breach& breach = breaches_[static_cast<std::size_t>(report_.nearest.structure)];
      if (guarded && !breach.open) ++breach.count;
      breach.open = in_structure_ = true;
    } else if (in_structure_ && report_.nearest.distance > potential_->field().slack()) {
      for (Breach& breach : breaches_) breach.open = false;
      in_structure_ = false;
    }
  }

  /// Returns the damping of one ball [N], for motion toward the structure at `approach` [m/s]. `part` is the ball's
  /// part of its structure's push.
  [[nodiscard]] static double damping(const GuardedStructure& s, const GuardPotential::Push& p, double part,
                                      double approach) noexcept {
    return s.margin > 0 ? s.damping * part * std::min(p.depth / s.margin, 1.0) * approach : 0.0;
  }

  void advance(const TickContext& context, bool in_margin) noexcept {
    const double wanted = options_.push ? 1.0 : 0.0;
    if (!in_margin) {
      share_ = wanted;
      return;
    }
    if (context.status >= Status::kJump) share_ = 0;
    const double step = context.dt / options_.ramp_time;
    share_ += std::clamp(wanted - share_, -step, step);
  }

  std::shared_ptr<const GuardPotential> potential_;
  Options options_;
  Posed X_SG_;
  std::vector<GuardPotential::Push> pushes_;
  std::vector<AxisProbe> probes_;
  std::vector<GuardPotential::Load> loads_;
  std::vector<Breach> breaches_;  // of each structure
  bool in_structure_ = false;     // a breach is open
  double share_ = 0;
  GuardReport report_;
};

}  // namespace trephine
