// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/release_bound.hpp>
#include <trephine/core/misuse.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/render/coupled/bristles.hpp>
#include <trephine/render/coupled/broad_phase.hpp>
#include <trephine/render/coupled/contact_list.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/coupled/drawn_pose.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/gains.hpp>
#include <trephine/render/coupled/pose_search.hpp>
#include <trephine/render/coupled/tool_in_bone.hpp>
#include <trephine/render/tool_load.hpp>
#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/voxel/gradient.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Reports template arguments that fit no coupled tool in one readable error message.
template <class Shape = BallAndShaft, class FrictionLaw = Frictionless>
class CoupledToolRenderer : public detail::UnusableRenderer {
  static_assert(detail::kFits<Shape>,
                "trephine::CoupledToolRenderer: write CoupledToolRenderer{burr, CoupledOptions{}, Coulomb{0.2, 0.15}}; "
                "the last two may be left out. As a type: CoupledToolRenderer<tool, friction>");

 public:
  template <class... Arguments>
  explicit CoupledToolRenderer(const Arguments&...) noexcept {}
};

/// Coupled tool: the whole drill is a proxy that rests on the bone, and a virtual coupling ties it to the device.
///
/// The coupling is static (Wan and McNeely 2003; Barbič and James 2008). The tool has its exact shape, and the bone's
/// own surface points hold it. The virtual tool's pose X minimises
///
///     E(X) = k Σ w_j φ(ψ_j(X)) + C_v(|p − p_dev|) + C_θ(|log(R_dev Rᵀ)|),    ψ_j(X) = −d_tool(X⁻¹ q_j)
///
/// over points q_j of the isosurface, each of area w_j (`BoneSurface`, `Foundation`). The hand feels the coupling
/// alone. So force and torque have one energy, the stiffness is bounded at any contact, and deep pushing is
/// allowed. On a plane the drawn tool sinks in by at most a third of a voxel, or a hundredth of its radius.
///
/// *Work a tick*: Newton steps with an active set (`PoseSearch`), at most kMaxSteps. No step moves any part of the tool
/// past its known clearance by more than half of its core's radius. So no surface passes the tool's axis, from which
/// points are pushed away. After a cut the search starts ahead, by at most half a voxel. Steps that remain are carried
/// on at the next tick (`kWorkBound`). So are bricks to make: contact is then not evaluated, the virtual tool stays,
/// and the scene cuts nothing. A tick may make as many bricks as a cut of the tool's head changes
/// (`bricks_about_head`).
///
/// *Statuses*: `kJump` as `CoupledOptions::jump` says. `kStartedInside` if the tool appears in contact, or bone appears
/// around it. While the tool's axis is in bone the status stays, there is no force, and the virtual tool is the
/// device's.
///
/// *Friction*: `Coulomb` at every point (`Bristles`); `Frictionless` costs nothing.
///
/// Numbers that decide are in `CoupledConstants`. Haptic thread. `render` is noexcept, and allocates nothing.
template <ToolShape Shape, Friction FrictionLaw>
class CoupledToolRenderer<Shape, FrictionLaw> {
 public:
  using Scalar = double;
  using Gradient = AnalyticGradient;
  /// Newton steps of a tick, at most.
  static constexpr int kMaxSteps = CoupledConstants::kMaxSteps;

  /// What a `Remote<CoupledToolRenderer>` receives: another tool; nothing changes nothing.
  using Options = std::optional<Shape>;

  /// Throws std::invalid_argument for options outside their range.
  CoupledToolRenderer(Shape shape, const CoupledOptions& options = {}, const FrictionLaw& friction = FrictionLaw{})
      : shape_(std::move(shape)),
        bounds_(shape_.bounds()),
        options_(options),
        head_(shape_.cutting_head(0)),
        bristles_(friction) {
    options.validate();
  }

  /// Takes the surface of this bone, which scenes of one thread share, and prepares for it. A scene calls it once.
  template <VoxelDensity Density>
  [[nodiscard]] std::shared_ptr<BoneSurface<Density>> attach(const VoxelGrid<Density>& bone, double isovalue) {
    std::shared_ptr<BoneSurface<Density>> surface = shared_bone_surface(bone, isovalue);
    prepare(surface->view());
    return surface;
  }
  /// Allocates for the tool in the voxels of this bone.
  template <class View>
  void prepare(const View& view) {
    spacing_ = view.grid().spacing();
    broad_phase_.reserve(view, 0);
    foundation_ = Foundation(1, Constants::kMaxPoints);
    bristles_.reserve(Constants::kMaxContacts, Constants::kMaxPoints);
    contacts_.reserve(Constants::kMaxContacts);
    fit_tool();
  }

  /// Takes another tool between ticks, no larger than the bone, with gains of its own. At the next tick the scene
  /// forgets contact, velocities and the state of its stages, as a new scene with that tool. So a tool that then lies
  /// in bone has `kStartedInside`, and its force is ramped. Haptic thread; no allocation. Another thread posts the tool
  /// to a Mailbox:
  /// \code
  /// Mailbox<std::optional<RevolvedTool>> tools;
  /// HapticScene scene{bone, 300, Remote{CoupledToolRenderer{MatchHead{}}, tools}, Cutting{}};
  /// tools.post(tool_by_name("pear-2.3").tool);
  /// \endcode
  void set_tool(const Shape& tool) noexcept {
    shape_ = tool;
    bounds_ = shape_.bounds();
    fit_tool();
    reset();
    tool_changed_ = true;
  }
  void adopt(const Options& tool) noexcept {
    if (tool) set_tool(*tool);
  }
  /// True once after `set_tool`: the scene resets itself.
  [[nodiscard]] bool take_tool_change() noexcept { return std::exchange(tool_changed_, false); }

  /// Returns the wrench on the tool about T's origin, G axes, for a device at X_device, `dt` seconds after the last
  /// tick.
  template <class View>
  Rendered<double> render(const View& view, const Posed& X_device, double dt = 1e-3) noexcept {
    NoLoad none;
    return render(view, X_device, dt, none);
  }
  /// The same with a load: its energy adds to E, so the tool rests on bone and load together.
  template <class View, ToolLoad Load>
  Rendered<double> render(const View& view, const Posed& X_device, double dt, Load& load) noexcept {
    Rendered<double> out;
    view.surface().begin_tick(std::max(bricks_per_tick_, view.surface().kBricksPerTick));
    const TickStart start = begin_tick(view, X_device);
    if (start.jumped) out.status = Status::kJump;
    const ToolMotion motion = motion_between(X_, X_device);
    Vec6d extension = Vec6d::Zero();
    if (axis_in_bone_ || (stays_clear(load, motion) && stays_in_air(view, motion))) {
      set_free(X_device);
      if (axis_in_bone_) out.status = worse(out.status, Status::kStartedInside);
    } else {
      const SearchResult found = search(view, X_device, start.device_motion, load);
      if (!found.converged) out.status = worse(out.status, Status::kWorkBound);
      if (start.restarts && found.initial_depth > Constants::kStartDepth * gains_.shortest_spacing)
        out.status = worse(out.status, Status::kStartedInside);
      out.evaluated = found.evaluation_count > 0;
      extension = out.evaluated ? report(found, out.contact, load) : hold(start.restarts);
    }
    if (!axis_in_bone_) load.settle(X_, dt);
    awaits_start_ = start.restarts && !out.evaluated;
    gives_wrench_ = extension.squaredNorm() > 0;
    if (out.evaluated)
      summary_ = out.contact;
    else if (gives_wrench_)
      out.contact = summary_;
    feel(extension, out);
    drawn_.follow(X_, start.restarts, bounds_.arm(), start.device_motion, dt);
    return out;
  }

  /// Goes on where a renderer of the same options is, in `view`, whose bone has the densities of the other's: the next
  /// ticks give the same bits. May allocate.
  template <class View>
  void take(const CoupledToolRenderer& other, const View& other_view, const View& view) {
    shape_ = other.shape_;
    bounds_ = other.bounds_;
    options_ = other.options_;
    gains_ = other.gains_;
    head_ = other.head_;
    bricks_per_tick_ = other.bricks_per_tick_;
    tool_changed_ = other.tool_changed_;
    broad_phase_.take(other.broad_phase_, other_view, view, shape_);
    foundation_ = other.foundation_;
    bristles_.take(other.bristles_);
    contacts_ = other.contacts_;
    X_ = other.X_;
    X_device_ = other.X_device_;
    last_motion_ = other.last_motion_;
    evaluated_ = other.evaluated_;
    const bool same = other.increase_stamp_ == other_view.grid().increase_stamp();
    increase_stamp_ = same ? view.grid().increase_stamp() : 0;
    started_ = other.started_;
    axis_in_bone_ = other.axis_in_bone_;
    awaits_start_ = other.awaits_start_;
    gives_wrench_ = other.gives_wrench_;
    summary_ = other.summary_;
    has_pose_ = other.has_pose_;
    drawn_ = other.drawn_;
    to_device_ = other.to_device_;
    unlisted_force_ = other.unlisted_force_;
    depth_ = other.depth_;
    steps_ = other.steps_;
  }

  /// Starts anew at the next tick. A tool whose axis is then in bone goes on from where the virtual tool was, if that
  /// is known to be out of bone.
  void reset() noexcept {
    started_ = false;
    gives_wrench_ = false;
    has_pose_ = has_pose_ && is_finite(X_);
    broad_phase_.invalidate();
    set_free(X_);
  }

  [[nodiscard]] const CoupledOptions& options() const noexcept { return options_; }
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  [[nodiscard]] double rotational_stiffness() const noexcept { return options_.rotational_stiffness; }
  /// Penetration depth of the deepest surface point in the virtual tool [m].
  [[nodiscard]] double penetration() const noexcept { return depth_; }
  /// Newton steps of the last tick.
  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// Law of the bone's pressure on the tool; valid once a scene is made.
  [[nodiscard]] const FoundationLaw& foundation_law() const noexcept { return gains_.law; }
  [[nodiscard]] const Shape& tool() const noexcept { return shape_; }
  /// A burr of the tool's size.
  [[nodiscard]] const Burr& shape() const noexcept { return shape_.burr(); }
  /// The head that cuts: a little larger than the tool's, so that the tool fits into its own hole.
  [[nodiscard]] const auto& cutting_head() const noexcept { return head_; }
  /// One contact per surface element in contact, friction included: G axes [m, N].
  [[nodiscard]] std::span<const ContactPoint<double>> contacts() const noexcept { return contacts_.contacts(); }
  /// Force on the tool of contacts for which `contacts()` has no room, G axes [N].
  [[nodiscard]] const Vec3d& unlisted_force() const noexcept { return unlisted_force_; }
  /// Pose of the virtual tool in G, where it touches bone and cuts.
  [[nodiscard]] Posed proxy_pose() const noexcept { return X_; }
  /// Bound on the wrench's change from tick to tick, which the scene applies (`CoupledOptions::release`).
  [[nodiscard]] ReleaseBound release_bound() const noexcept {
    const bool turns = options_.has_torque();
    const double lever = turns ? std::sqrt(options_.rotational_stiffness / options_.stiffness) : Constants::kHandLever;
    return {options_.stiffness, lever, options_.release, turns};
  }
  /// Pose at which the tool is drawn: the virtual tool's, or on the way there where it snapped past an edge. It moves
  /// by no more than the device does, and kDrawnSpeed.
  [[nodiscard]] Posed visual_pose() const noexcept { return drawn_.pose(); }
  /// Pose of the virtual tool in G, moved toward the device by at most `CoupledOptions::bite`: for a cut in time.
  [[nodiscard]] Posed cutting_pose() const noexcept { return ahead(options_.bite * gains_.shortest_spacing); }
  /// The same for a cut at once, at the end of a tick of `dt` seconds.
  [[nodiscard]] Posed cutting_pose(double dt) const noexcept {
    return ahead(options_.bite * gains_.shortest_spacing * (dt / CoupledOptions::kBiteTime));
  }

  /// The same for a cut by pressure whose law allows `advance` [m], with `CoupledOptions::bite` in longest spacings. It
  /// goes a little ahead in any case: places where the voxels hold the tool's shape worst are cut too.
  [[nodiscard]] Posed pressure_cutting_pose(double advance = 0) const noexcept {
    const double bite = options_.bite * spacing_.maxCoeff();
    return ahead(std::clamp(advance, CoupledOptions::kPressureBite * bite, bite));
  }

 private:
  using Constants = CoupledConstants;

  /// Derives from the tool what depends on it.
  void fit_tool() noexcept {
    gains_ = CoupledGains::derive(shape_.burr(), options_, spacing_);
    head_ = shape_.cutting_head(gains_.cut_allowance);
    broad_phase_.set_contact(gains_.law.offset, gains_.level);
    foundation_.set_side(gains_.points_per_side);
    bricks_per_tick_ = bricks_about_head(bounds_, spacing_);
  }

  /// Pose of the virtual tool, moved toward the device by at most `max_distance` [m].
  [[nodiscard]] Posed ahead(double max_distance) const noexcept {
    const double distance = to_device_.norm();
    Posed X = X_;
    X.translation() += distance > max_distance ? Vec3d(to_device_ * (max_distance / distance)) : to_device_;
    return X;
  }

  /// State at the start of a tick.
  struct TickStart {
    ToolMotion device_motion;  // since the last tick
    bool jumped;
    bool restarts;  // the contacts of the last tick do not hold any more
  };

  template <class View>
  TickStart begin_tick(const View& view, const Posed& X_device) noexcept {
    const ToolMotion motion = motion_between(X_device_, X_device);
    const bool jumped = started_ && !motion.is_within({options_.jump, Constants::kJumpAngle});
    const bool densities_rose = started_ && increase_stamp_ != view.grid().increase_stamp();
    const TickStart start{.device_motion = started_ ? motion : ToolMotion{},
                          .jumped = jumped,
                          .restarts = !started_ || jumped || densities_rose || axis_in_bone_ || awaits_start_};
    increase_stamp_ = view.grid().increase_stamp();
    X_device_ = X_device;
    if (start.restarts) {
      bristles_.reset();
      evaluated_.reset();
      last_motion_.setZero();
      // A start or a jump with the axis in bone: the virtual tool follows from its last pose, if that is free.
      if (axis_in_bone_ || !has_pose_ || ((!started_ || jumped) && !is_core_in_bone(view, bounds_, X_device)))
        X_ = X_device;
      axis_in_bone_ = is_core_in_bone(view, bounds_, X_);
      has_pose_ = true;
    }
    started_ = true;
    return start;
  }

  /// Returns true if no bone is in the way of a motion of the virtual tool. What a map of air proves holds for some
  /// way more, so that the next ticks need not ask it.
  template <class View>
  [[nodiscard]] bool stays_in_air(const View& view, const ToolMotion& motion) noexcept {
    if (broad_phase_.is_empty_around(view, X_, motion)) return true;
    const double arm = bounds_.arm(), slack = Constants::kMaxReach * gains_.shortest_spacing;
    if (!is_known_in_air(view, bounds_, X_, motion.at(arm))) return false;
    const ToolMotion reach = motion + ToolMotion{slack, slack / arm};
    if (is_known_in_air(view, bounds_, X_, reach.at(arm))) broad_phase_.set_empty(view, X_, reach);
    return true;
  }

  /// Returns true if no load is in the way of a motion of the virtual tool. A way that is too short to pass the tool's
  /// axis is clear if both ends are.
  template <class Load>
  [[nodiscard]] bool stays_clear(Load& load, const ToolMotion& motion) const noexcept {
    if constexpr (std::same_as<Load, NoLoad>) {
      return true;
    } else {
      const double way = motion.at(bounds_.arm());
      if (load.clearance(X_) >= way) return true;
      return way <= Constants::kCoreFraction * bounds_.core_radius && !(load.press(X_).energy > 0) &&
             !(load.press(X_device_).energy > 0);
    }
  }

  /// Places the virtual tool at X, without contact.
  void set_free(const Posed& X) noexcept {
    X_ = X;
    to_device_.setZero();
    depth_ = 0;
    steps_ = 0;
    last_motion_.setZero();
    evaluated_.reset();
    bristles_.reset();
    contacts_.clear();
    unlisted_force_.setZero();
  }

  /// Evaluates contact, friction and coupling at X. Returns nothing while the bone's surface there is not available.
  template <class View, class Load>
  [[nodiscard]] std::optional<PoseEvaluation> evaluate(const View& view, const Posed& X,
                                                       const ToolMotion& device_motion, Load& load) noexcept {
    if (!evaluated_ || X.matrix() != evaluated_->X.matrix()) {
      evaluated_.reset();
      if (!broad_phase_.update(view, shape_, X, device_motion)) return std::nullopt;
      evaluated_ = EvaluatedContact{X, foundation_.sum(broad_phase_.elements(), shape_, X, gains_.law)};
    }
    bristles_.attach(foundation_.points(), X, gains_.law.stiffness);
    PoseEvaluation found{evaluated_->contact, bristles_.linearise(Vec6d::Zero()),
                         gains_.coupling.evaluate(X, X_device_), gains_.coupling.solves_rotation};
    if constexpr (!std::same_as<Load, NoLoad>) add(load, X, found);
    return found;
  }
  /// Adds a load to the contact with bone.
  template <class Load>
  void add(Load& load, const Posed& X, PoseEvaluation& found) const noexcept {
    const double distance = load.clearance(X);
    if (distance == std::numeric_limits<double>::infinity()) return;  // a load that is nowhere changes no bit
    const LoadSum sum = load.press(X);
    found.contact.energy += sum.energy;
    found.contact.wrench += sum.wrench;
    found.contact.stiffness += sum.stiffness;
    found.load_depth = sum.depth;
    if (sum.energy > 0) return;
    Clearance& clear = found.contact.clearance;
    clear.listed_distance = std::min(clear.listed_distance, std::max(distance, 0.0));
    clear.listed_arm = std::max(clear.listed_arm, bounds_.arm());
  }

  template <class View, class Load>
  SearchResult search(const View& view, const Posed& X_device, const ToolMotion& device_motion, Load& load) noexcept {
    bristles_.begin_tick(X_);
    // Warm start at the pose evaluated last, whose contact is stored. Where bone was cut there, the tool likely moves
    // on as in the last tick. Bristles must begin at its last pose.
    if (evaluated_ && !broad_phase_.is_current(view)) evaluated_.reset();
    const double h = gains_.shortest_spacing;
    Posed start = gains_.coupling.solves_rotation && evaluated_ ? evaluated_->X : X_;
    if (!evaluated_ && !bristles_.has_friction()) {
      const Posed ahead = moved(X_, last_motion_);
      const double most = std::min(Constants::kMaxStartAhead * h, Constants::kCoreFraction * bounds_.core_radius);
      if (motion_between(X_, ahead).at(bounds_.arm()) <= most) start = ahead;
    }
    if (!gains_.coupling.solves_rotation) start.linear() = X_device.linear();
    PoseSearch search(
        gains_.coupling, X_device, bounds_, [&](const Posed& X) { return evaluate(view, X, device_motion, load); },
        bristles_);
    return search.minimise(start,
                           {.smallest_step = Constants::kSmallestStep * h,
                            .motion_step = Constants::kMotionFraction *
                                           std::min(device_motion.at(bounds_.arm()), Constants::kMaxCountedMotion * h)},
                           last_motion_);
  }

  /// Takes the result of a search. Returns the coupling's extension: the small motion from the virtual tool to the
  /// device.
  template <class Load>
  [[nodiscard]] Vec6d report(const SearchResult& found, ContactSummary& summary, Load& load) noexcept {
    // Free, but for contact shallower than the smallest step.
    if (found.converged && !found.evaluation.contact.has_contact()) {
      set_free(X_device_);
      return Vec6d::Zero();
    }
    last_motion_ = motion_to(X_, found.X);
    X_ = found.X;
    steps_ = found.step_count;
    if (!evaluated_) foundation_.clear();
    const Vec6d extension = extend();
    depth_ = found.evaluation.contact.depth;
    report_contacts(found.last_step, summary);
    unlisted_force_.setZero();
    if (!contacts_.is_complete() || !foundation_.has_all_points()) {
      // All contacts together balance the coupling.
      unlisted_force_ = -linear_part(coupling_wrench(extension));
      for (const auto& c : contacts_.contacts()) unlisted_force_ -= c.force;
      if constexpr (!std::same_as<Load, NoLoad>) unlisted_force_ -= linear_part(load.press(X_).wrench);
    }
    // A search that reached its bound in the air, behind the device, gives no force.
    if (!found.found_contact) return Vec6d::Zero();
    if (summary.count > 0) summary.depth = to_device_.norm() + depth_;
    return extension;
  }

  /// Keeps the virtual tool where contact was evaluated last, since it would sink into bone unseen. Returns the
  /// coupling's extension, if that was felt.
  [[nodiscard]] Vec6d hold(bool restarts) noexcept {
    if (restarts || !gives_wrench_) {
      set_free(X_);
      return Vec6d::Zero();
    }
    return extend();
  }

  /// Returns the coupling's extension, and stores its translation.
  [[nodiscard]] Vec6d extend() noexcept {
    Vec6d extension = motion_to(X_, X_device_);
    if (!gains_.coupling.solves_rotation) clear_angular(extension);
    to_device_ = linear_part(extension);
    return extension;
  }

  /// Force [N] and torque [N·m] of the coupling on the virtual tool at an extension.
  [[nodiscard]] Vec6d coupling_wrench(const Vec6d& extension) const noexcept {
    return VirtualCoupling::wrench(gains_.coupling.evaluate(linear_part(extension), angular_part(extension)));
  }

  /// Sets the wrench on the hand, which the coupling gives at an extension.
  void feel(const Vec6d& extension, Rendered<double>& out) const noexcept {
    if (!(extension.squaredNorm() > 0)) return;
    const Vec6d on_tool = coupling_wrench(extension);
    const Vec3d force = -linear_part(on_tool), torque = -angular_part(on_tool);
    out.wrench = {force, torque};
  }

  void report_contacts(const Vec6d& last_step, ContactSummary& summary) noexcept {
    const std::span<const FoundationPoint> points = foundation_.points();
    const double k = gains_.law.stiffness;
    contacts_.clear();
    // The points' arms are from the tool's origin before the last step.
    const Vec3d p = X_.translation() - linear_part(last_step), u = z_axis(X_);
    const double head_top = bounds_.head_top + u.dot(linear_part(last_step));
    for (const FoundationPoint& q : points) {
      const double load = k * q.weight * depth_after_motion(q, last_step);
      if (!(load > 0)) continue;
      const bool tip = q.arm.dot(u) <= head_top;
      summary.tip = summary.tip || tip;
      summary.shaft = summary.shaft || !tip;
      contacts_.add(q, load);
    }
    bristles_.commit(points, last_step,
                     [&](std::size_t i, const Vec3d& f) { contacts_.add_force(points[i].element, f); });
    contacts_.finish(p);
    summary.count = static_cast<int>(contacts_.contacts().size());
  }

  /// The last evaluation of contact, without friction.
  struct EvaluatedContact {
    Posed X;
    FoundationSum contact;
  };

  Shape shape_;
  ToolBounds bounds_;
  CoupledOptions options_;
  CoupledGains gains_;
  std::remove_cvref_t<decltype(std::declval<const Shape&>().cutting_head(0.0))> head_;
  BroadPhase broad_phase_;
  Foundation foundation_;
  [[no_unique_address]] Bristles<FrictionLaw> bristles_;
  ContactList contacts_;
  Vec3d spacing_ = Vec3d::Ones();  // of the grid [m]
  int bricks_per_tick_ = 0;        // of the bone's surface, at most
  bool tool_changed_ = false;      // since the scene asked

  // State from tick to tick.
  Posed X_ = Posed::Identity();
  Posed X_device_ = Posed::Identity();
  Vec6d last_motion_ = Vec6d::Zero();  // of the virtual tool, in the last tick
  std::optional<EvaluatedContact> evaluated_;
  std::uint64_t increase_stamp_ = 0;  // of the grid: changes when densities rise
  bool started_ = false;
  bool axis_in_bone_ = false;
  bool awaits_start_ = false;  // contact has not been evaluated since the start
  bool gives_wrench_ = false;  // the coupling gave a wrench at the last tick
  ContactSummary summary_;     // of the last evaluation
  bool has_pose_ = false;      // X_ is of an earlier tick

  // Results of the last tick.
  DrawnPose drawn_;
  Vec3d to_device_ = Vec3d::Zero();       // from the virtual tool to the device [m]
  Vec3d unlisted_force_ = Vec3d::Zero();  // [N]
  double depth_ = 0;                      // of the deepest point [m]
  int steps_ = 0;
};

// A tool; the measures of one or a NamedTool; a burr; something else.
template <ToolShape Shape, std::convertible_to<CoupledOptions> Options = CoupledOptions,
          Friction FrictionLaw = Frictionless>
CoupledToolRenderer(Shape, Options = {}, FrictionLaw = FrictionLaw{}) -> CoupledToolRenderer<Shape, FrictionLaw>;
template <class Measures, std::convertible_to<CoupledOptions> Options = CoupledOptions,
          Friction FrictionLaw = Frictionless>
  requires(std::convertible_to<Measures, typename Measures::Tool> && !ToolShape<Measures>)
CoupledToolRenderer(Measures, Options = {}, FrictionLaw = FrictionLaw{})
    -> CoupledToolRenderer<typename Measures::Tool, FrictionLaw>;
template <std::convertible_to<CoupledOptions> Options = CoupledOptions, Friction FrictionLaw = Frictionless>
CoupledToolRenderer(Burr, Options = {}, FrictionLaw = FrictionLaw{}) -> CoupledToolRenderer<BallAndShaft, FrictionLaw>;
template <class... Arguments>
CoupledToolRenderer(const Arguments&...) -> CoupledToolRenderer<detail::Misused<Arguments...>>;

}  // namespace trephine
