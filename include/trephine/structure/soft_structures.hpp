// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/number.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/render/tool_load.hpp>
#include <trephine/structure/guard_potential.hpp>
#include <trephine/structure/membrane.hpp>
#include <trephine/structure/membrane_tears.hpp>
#include <trephine/structure/structure_field.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Output of soft structures in one tick, at the pose of the virtual tool. Forces are the true ones: a device gets
/// `SoftOptions::force_scale` of them.
struct SoftReport {
  int structure = -1;     ///< the one pressed with the greatest force; -1: none
  double depth = 0;       ///< of the tool in it, as its membrane counts it: v [m]
  double force = 0;       ///< on the tool [N]
  double energy = 0;      ///< of all [J]
  double dissipated = 0;  ///< lost in tearing since the start or `heal` [J]
  bool tears = false;     ///< some place tears in this tick
};

/// The part of a scene that makes structures felt as membranes once the bone over them is gone.
/// \code
/// const std::vector<std::optional<Membrane>> soft{dura(), std::nullopt};  // of each structure of the field
/// HapticScene scene{bone, 300, CoupledToolRenderer{burr}, Cutting{PressureCut{}, CuttingForce{...}},
///                   SoftStructures{field, X_GS, burr, soft}};
/// \endcode
/// *Force.* The tool is the union of balls of a GuardPotential, and u_z is how deep ball z is in the structure, by its
/// smoothed distance. With the membrane's law Ψ (`Membrane`) and weights w_z that are 1 for the tip
///
///     U = Σ_structures s Ψ(v),    v = (Σ_z w_z (σ u_z)^4)^(1/4),
///
/// where s is the device's share and σ is 1 in whole places. Outside of the structure there is no force. Inside, force
/// and torque are the exact derivatives of U, so closed paths do no work.
///
/// *Bone over it.* U is added to the energy of which the renderer finds the least (`ToolLoad`): the virtual tool rests
/// on bone and membrane together. Bone that keeps the virtual tool out of a structure so keeps its membrane from being
/// felt, however deep the device is. The hand feels the coupling alone, so membranes never add to the device's
/// stiffness, force or release bounds, and a tool that is pressed into one is drawn in its dent. It takes a renderer
/// that carries loads, which the coupled tool does.
///
/// *Rupture.* Where v reaches the law's `rupture_depth` the membrane tears for good: σ falls to `Membrane::rest` at the
/// place of the deepest ball, linearly within `tear_time`, and rises smoothly to 1 at two of the tool's radii from an
/// axis through it along the distance's gradient. A tool that reaches the rupture depth within a torn place widens it,
/// by that radius in a `tear_time`. σ never rises, so the energy set free is dissipated, and none goes to the hand.
/// `heal` mends all.
///
/// *Labels.* A structure is all that lies behind its membrane, as brain and dura in one label: depths are below its
/// surface. Its voxels should be below the isovalue, for what is not is bone to contact and cuts, whatever its label. A
/// Veto or Protection keeps cuts out of bone at it, as of any structure; with none, the burr takes the bone down to the
/// membrane. A cutting law finds no bone there, so its forces end. A tear goes through: in a thin structure it opens
/// the far side too.
///
/// No damping: list a Damping. Haptic thread; allocates at construction only.
class SoftStructures {
 public:
  /// `membranes` has an entry for each structure of the field, in its order; those without one are not felt. Throws
  /// std::invalid_argument for options out of range, no membrane, a tool without a ball at its tip, or a field whose
  /// bands do not reach `required_reach`, and else as a GuardPotential.
  template <class Tool>
  SoftStructures(std::shared_ptr<const StructureField> field, const Posed& X_GS, const Tool& tool,
                 std::span<const std::optional<Membrane>> membranes, const SoftOptions& options = {})
      : options_(options),
        potential_(std::make_shared<const GuardPotential>(std::move(field), X_GS, tool, guards_of(membranes),
                                                          GuardPotentialOptions{.smoothing = options.smoothing})),
        X_SG_(inverse(X_GS)) {
    options.validate();
    const double radius = potential_->burr().tip_radius;
    tear_radius_ = kTearWidth * radius;
    double deepest = 0;
    for (const std::optional<Membrane>& m : membranes) {
      membranes_.push_back(m.value_or(Membrane{}));
      laws_.push_back(membranes_.back().law(radius, options.force_scale));
      if (m) deepest = std::max(deepest, laws_.back().rupture_depth);
    }
    if (!(deepest > 0)) refuse("SoftStructures", "some structure must have a membrane", "none");
    const double reach = deepest + kSplineReach * options.smoothing;
    if (potential_->field().reach() < reach)
      refuse("SoftStructures",
             "the field's bands must reach the rupture depth + 2.6 smoothing = " + number_text(1e3 * reach) + " mm",
             1e3 * potential_->field().reach());
    pushes_.resize(potential_->most_pushes());
    probes_.resize(potential_->most_probes());
    sums_.resize(membranes_.size());
  }

  /// Returns the reach that a field's bands need for this tool and these membranes [m].
  template <class Tool>
  [[nodiscard]] static double required_reach(const Tool& tool, std::span<const std::optional<Membrane>> membranes,
                                             const SoftOptions& options = {}) {
    double reach = GuardPotential::required_reach(tool, 0, options.smoothing);
    for (const std::optional<Membrane>& m : membranes)
      if (m)
        reach = std::max(reach, m->law(holding_burr(tool).tip_radius).rupture_depth + kSplineReach * options.smoothing);
    return reach;
  }

  [[nodiscard]] const SoftOptions& options() const noexcept { return options_; }
  /// Takes another share of the true forces for the device, which `SoftOptions` allow; between ticks.
  void set_force_scale(double scale) noexcept {
    options_.force_scale = scale;
    for (std::size_t i = 0; i < laws_.size(); ++i)
      laws_[i] = membranes_[i].law(potential_->burr().tip_radius, options_.force_scale);
    is_pressed_ = false;
  }
  [[nodiscard]] const SoftReport& report() const noexcept { return report_; }
  /// Returns the law of a structure with a membrane, with the device's share of its forces.
  [[nodiscard]] const MembraneLaw& law(int structure) const noexcept {
    return laws_[static_cast<std::size_t>(structure)];
  }
  /// Returns where membranes are torn.
  [[nodiscard]] const MembraneTears& tears() const noexcept { return tears_; }
  /// Mends all tears; while the tool is clear of them, or its force steps by as much as the renderer allows.
  void heal() noexcept {
    tears_.clear();
    is_pressed_ = false;
  }
  /// Takes the tears that another tool made in the same field; between ticks, as `heal`.
  void take_tears(const MembraneTears& tears) noexcept {
    tears_ = tears;
    is_pressed_ = false;
  }

  /// Gives the scene's renderer the load, which is this.
  [[nodiscard]] SoftStructures& tool_load() noexcept { return *this; }
  void begin_tick() noexcept {
    report_ = {};
    report_.dissipated = tears_.dissipated();
  }

  /// Returns the membranes' energy at a pose in G, with its derivatives. The last pose's is kept.
  [[nodiscard]] LoadSum press(const Posed& X_GT) noexcept {
    if (!is_pressed_ || X_GT.matrix() != X_pressed_.matrix()) evaluate(X_GT);
    return sum_;
  }

  /// Returns a distance by which the tool may move from a pose in G without touching any structure [m]; <= 0: unknown.
  [[nodiscard]] double clearance(const Posed& X_GT) noexcept {
    GuardPotential::Clear known = known_clearance(X_GT);
    // A tip that touched is looked up again where it went on by a part of its radius.
    const double least_tip =
        clear_.tip > 0 ? kKnownShare * clear_.tip : clear_.tip - kKnownShare * potential_->burr().tip_radius;
    if (!(known.tip > least_tip && known.shaft > kKnownShare * clear_.shaft)) {
      X_clear_ = X_GT;
      known = clear_ = potential_->clearance(X_SG_ * X_GT);
    }
    return std::min(known.tip, known.shaft);
  }

  /// Tears where the tool at a pose in G went too deep, goes on with what tears, and reports.
  void settle(const Posed& X_GT, double dt) noexcept {
    const double before = press(X_GT).energy;
    const bool strains = before > 0 && strain(X_SG_ * X_GT, dt);
    const bool opens = tears_.open(dt);
    const bool tears = strains || opens;
    if (tears) {
      evaluate(X_GT);
      tears_.dissipate(std::max(0.0, before - sum_.energy) / options_.force_scale);
    }
    report_ = pressed_;
    report_.dissipated = tears_.dissipated();
    report_.tears = tears;
  }
  /// Reports to the tick's result.
  void add_to(StructureSummary& summary) const noexcept {
    summary.soft_force = std::max(summary.soft_force, report_.force);
    summary.tears = summary.tears || report_.tears;
  }

 private:
  [[nodiscard]] static std::vector<GuardedStructure> guards_of(std::span<const std::optional<Membrane>> membranes) {
    std::vector<GuardedStructure> guards;
    for (const std::optional<Membrane>& m : membranes) {
      if (m) m->validate();
      guards.push_back({.mode = m ? GuardMode::kPush : GuardMode::kOff, .margin = 0});
    }
    return guards;
  }

  /// Returns what is left of the last clearance at a pose in G.
  [[nodiscard]] GuardPotential::Clear known_clearance(const Posed& X_GT) const noexcept {
    const Vec3d shift = X_GT.translation() - X_clear_.translation();
    const Vec3d turn = z_axis(X_GT) - z_axis(X_clear_);
    const double way = shift.norm();
    return {clear_.tip - way, clear_.shaft - way - turn.norm() * potential_->burr().shaft_length};
  }

  /// Finds the balls in structures, with depth and gradient as the membranes count them, and each structure's v.
  /// Gradients are of depths, in G. Returns false if there is none.
  bool find(const Posed& X_GT) noexcept {
    const GuardPotential::Clear known = known_clearance(X_GT);
    found_ = 0;
    if (known.shaft > 0 && known.tip > 0) return false;
    const Posed X_ST = X_SG_ * X_GT;
    found_ = known.shaft > 0 ? potential_->find_tip(X_ST, pushes_) : potential_->find(X_ST, pushes_, probes_).pushes;
    if (found_ == 0) return false;
    std::fill(sums_.begin(), sums_.end(), 0.0);
    const Mat3d R_GS = potential_->X_GS().linear();
    for (GuardPotential::Push& p : found()) {
      p.gradient = -p.gradient;
      if (!tears_.none()) tears_.weaken(p.structure, X_ST.translation() + p.z * z_axis(X_ST), p.depth, p.gradient);
      p.gradient = product(R_GS, p.gradient);
      sums_[static_cast<std::size_t>(p.structure)] += p.powered();
    }
    for (double& sum : sums_) sum = std::sqrt(std::sqrt(sum));
    return true;
  }

  /// Finds the load at a pose, and keeps it.
  void evaluate(const Posed& X_GT) noexcept {
    X_pressed_ = X_GT;
    is_pressed_ = true;
    sum_ = {};
    pressed_ = {};
    if (!find(X_GT)) return;
    const Vec3d axis = z_axis(X_GT);
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      const double v = sums_[i];
      if (!(v > 0)) continue;
      const MembraneLaw::Response now = laws_[i].at(v);
      sum_.energy += now.energy;
      sum_.depth = std::max(sum_.depth, v);
      Vec6d J = Vec6d::Zero();  // ∂v
      for (const GuardPotential::Push& p : found()) {
        if (static_cast<std::size_t>(p.structure) != i) continue;
        const double share = p.depth / v, by = p.weight * share * share;
        const Vec6d j = spatial(p.gradient, (p.z * axis).cross(p.gradient));
        J += by * share * j;
        // ∂²v of depths that change at even rates: 3 / v (Σ w (u/v)² j jᵀ − J Jᵀ).
        add_outer(sum_.stiffness, 3 * now.force / v * by, j);
      }
      sum_.wrench -= now.force * J;
      add_outer(sum_.stiffness, now.tangent - 3 * now.force / v, J);
      const double force = now.force / options_.force_scale * linear_part(J).norm();
      if (!(force > pressed_.force)) continue;
      pressed_.structure = static_cast<int>(i);
      pressed_.depth = v;
      pressed_.force = force;
    }
    pressed_.energy = sum_.energy / options_.force_scale;
  }

  [[nodiscard]] std::span<GuardPotential::Push> found() noexcept { return {pushes_.data(), found_}; }

  /// Begins or widens tears of what `find` found too deep; returns true if there is any.
  bool strain(const Posed& X_ST, double dt) noexcept {
    bool any = false;
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      if (!(sums_[i] >= laws_[i].rupture_depth)) continue;
      const GuardPotential::Push* deepest = nullptr;
      for (const GuardPotential::Push& p : found())
        if (static_cast<std::size_t>(p.structure) == i && (deepest == nullptr || p.powered() > deepest->powered()))
          deepest = &p;
      if (deepest == nullptr) continue;
      const int structure = static_cast<int>(i);
      const Vec3d p_S = X_ST.translation() + deepest->z * z_axis(X_ST);
      any = tears_.tear(structure, p_S, tear_radius_, membranes_[i], dt, [&](const Vec3d& at_S, Vec3d& gradient_S) {
        return potential_->smooth_distance(structure, at_S, gradient_S);
      }) || any;
    }
    return any;
  }

  /// Adds k v vᵀ to both triangles.
  static void add_outer(Mat6d& m, double k, const Vec6d& v) noexcept {
    for (Eigen::Index c = 0; c < 6; ++c)
      for (Eigen::Index r = 0; r < 6; ++r) m(r, c) += k * v[r] * v[c];
  }

  // A tear is wider than the ball that made it, so that the ball passes.
  static constexpr double kTearWidth = 2;      // [radii of the tip]
  static constexpr double kKnownShare = 0.25;  // of a clearance, above which it is not looked up anew
  static constexpr double kSplineReach = 2.6;  // [smoothings]: a knot is that near

  SoftOptions options_;
  std::shared_ptr<const GuardPotential> potential_;
  Posed X_SG_;
  std::vector<Membrane> membranes_;  // of each structure
  std::vector<MembraneLaw> laws_;
  double tear_radius_ = 0;             // [m]
  Posed X_clear_ = Posed::Identity();  // in G, at the last look-up of the clearance
  GuardPotential::Clear clear_;        // that was found there
  MembraneTears tears_;

  std::vector<GuardPotential::Push> pushes_;
  std::size_t found_ = 0;  // of pushes_
  std::vector<AxisProbe> probes_;
  std::vector<double> sums_;  // v of each structure

  // The load at the pose that was evaluated last.
  Posed X_pressed_ = Posed::Identity();  // in G
  bool is_pressed_ = false;              // it holds
  LoadSum sum_;
  SoftReport pressed_;
  SoftReport report_;  // of the tick
};

}  // namespace trephine
