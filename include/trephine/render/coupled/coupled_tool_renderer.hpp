// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/render/coupled/bristles.hpp>
#include <trephine/render/coupled/broad_phase.hpp>
#include <trephine/render/coupled/contact_list.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/gains.hpp>
#include <trephine/render/coupled/pose_search.hpp>
#include <trephine/render/coupled/tool_in_bone.hpp>
#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/voxel/gradient.hpp>

#include <cmath>
#include <optional>
#include <utility>

namespace trephine {

/// The whole tool as a proxy: a static virtual coupling (Wan and McNeely 2003; Barbič and James 2008) to a tool of
/// exact shape that the bone's own surface points hold. The virtual tool's pose X minimises
///
///     E(X) = k Σ w_j φ(ψ_j(X)) + C_v(|p − p_dev|) + C_θ(|log(R_dev Rᵀ)|),    ψ_j(X) = −d_tool(X⁻¹ q_j)
///
/// over points q_j of the isosurface, each of area w_j (`BoneSurface`, `Foundation`). The hand feels the coupling
/// alone: force and torque come from one energy, its stiffness is bounded whatever touches, deep pushing is allowed and
/// the drawn tool sinks in by at most a third of a voxel on a plane.
///
/// *Work a tick*: Newton's steps (`PoseSearch`), at most kMostSteps. No step moves any part of the tool farther than
/// the free way known plus half of its core's radius, so no surface passes the tool's axis, which is where a point is
/// pushed away from. Steps, or bricks to make, that are left over are carried on at the next tick (`kWorkBound`).
///
/// *Statuses*: kJump (see options); kStartedInside where the tool appears in contact, or bone appears round it, and as
/// long as its axis is in bone: then no force, and the virtual tool is the device's, until it has left the bone.
///
/// *Friction*: `Coulomb`, at every point (`Bristles`); `Frictionless` costs nothing.
template <RealScalar S = double, ToolShape Shape = BallAndShaft, Friction FrictionLaw = Frictionless,
          CoupledMotion Motion = SixDof>
class CoupledToolRenderer {
 public:
  using Scalar = S;
  using Gradient = AnalyticGradient;
  static constexpr bool kUsesBoneSurface = true;
  static constexpr int kMostSteps = SearchTolerance::kMostSteps;
  /// A search ends where its next step would be smaller than this share of what the device moved, or with one smaller
  /// than kSmallestStep [shortest spacings].
  static constexpr double kOfMotion = 0.02, kSmallestStep = 1e-6;
  /// A device whose axis turned farther between two ticks jumped [rad]: no hand turns as quickly, at 60 Hz either.
  static constexpr double kMostTurn = 0.5;
  /// A device that moved farther counts as moved by this [shortest spacings].
  static constexpr double kMostSlid = 0.5;

  /// Throws std::invalid_argument for options outside their range.
  CoupledToolRenderer(Shape shape, const CoupledOptions& options = {}, const FrictionLaw& friction = FrictionLaw{})
      : shape_(std::move(shape)), bounds_(shape_.bounds()), options_(options), bristles_(friction) {
    gains_.cutting_burr = shape_.burr();
    options.validate();
  }

  /// Takes memory for the tool in voxels of this bone; a scene calls it once, before its first tick.
  template <class View>
  void prepare(const View& view) {
    const bool turns = Motion::kDof == 6 && std::isfinite(options_.rotational_stiffness);
    gains_ = CoupledGains::of(shape_.burr(), options_, turns, view.grid().spacing(), view.surface().longest_part());
    near_.reserve(view, gains_.law.offset);
    foundation_ = Foundation(gains_.side, kMostPoints);
    bristles_.reserve(kMostContacts, foundation_.side() * foundation_.side(), kMostPoints);
    contacts_.reserve(kMostContacts);
  }

  template <class View>
  Rendered<Scalar> render(const View& view, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> out;
    const Posed X_device = X_GT.template cast<double>();
    view.surface().begin_tick();
    const TickStart begun = begin(view, X_device);
    if (begun.jumped) out.status = Status::kJump;
    const ToolMotion motion = motion_between(X_, X_device);
    if (inside_ || near_.is_empty_around(view, X_, motion) ||
        is_known_in_air(view, bounds_, X_, motion.at(bounds_.arm()))) {
      set_free(X_device);
      if (inside_) out.status = worse(out.status, Status::kStartedInside);
      return out;
    }
    const SearchResult found = search(view, X_device, begun.slid);
    if (!found.ended) out.status = worse(out.status, Status::kWorkBound);
    if (begun.fresh && found.first_depth > kTouching * gains_.voxel)
      out.status = worse(out.status, Status::kStartedInside);
    report(found, out);
    return out;
  }

  void reset() noexcept {
    started_ = false;
    inside_ = false;
    near_.invalidate();
    set_free(X_);
  }

  [[nodiscard]] const CoupledOptions& options() const noexcept { return options_; }
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  [[nodiscard]] double rotational_stiffness() const noexcept { return options_.rotational_stiffness; }
  /// How deep the deepest point of the bone's surface is in the virtual tool [m].
  [[nodiscard]] double penetration() const noexcept { return depth_; }
  /// Newton's steps that the last tick took.
  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// The pressure of bone on the tool; known once a scene is made.
  [[nodiscard]] const FoundationLaw& foundation_law() const noexcept { return gains_.law; }
  [[nodiscard]] const Shape& tool() const noexcept { return shape_; }
  /// The burr that cuts: a little larger than the tool's, so that the tool fits into what it cut.
  [[nodiscard]] const Burr& shape() const noexcept { return gains_.cutting_burr; }
  /// One for each element of the bone's surface that touches, friction included.
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept { return contacts_.contacts(); }
  /// The virtual tool.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_.template cast<Scalar>(); }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return proxy_pose(); }
  /// The virtual tool and its bite: of a cut in time, and of a cut at once at the end of a tick of `dt` seconds.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return ahead(options_.bite * gains_.voxel); }
  [[nodiscard]] Pose<Scalar> cutting_pose(double dt) const noexcept {
    return ahead(options_.bite * gains_.voxel * (dt / CoupledOptions::kBiteTime));
  }

 private:
  static constexpr std::size_t kMostPoints = 16384, kMostContacts = 2048;
  /// A tool that appears with bone deeper in it than this [shortest spacings] is in contact.
  static constexpr double kTouching = 0.1;

  /// The virtual tool, pushed on toward the device's pose by `most` metres at most.
  [[nodiscard]] Pose<Scalar> ahead(double most) const noexcept {
    const double left = way_.norm();
    Posed X = X_;
    X.translation() += left > most ? Vec3d(way_ * (most / left)) : way_;
    return X.template cast<Scalar>();
  }

  /// What a tick begins with.
  struct TickStart {
    double slid;  // what the device moved since the last tick [m]
    bool jumped;
    bool fresh;  // nothing is known of what touched before
  };

  template <class View>
  TickStart begin(const View& view, const Posed& X_device) noexcept {
    const bool jumped = started_ && !((X_device.translation() - X_device_.translation()).norm() <= options_.jump &&
                                      (X_device.linear().col(2) - X_device_.linear().col(2)).norm() <= kMostTurn);
    const bool risen = started_ && stamp_ != view.grid().increase_stamp();
    const TickStart begun{.slid = started_ ? motion_between(X_device_, X_device).at(bounds_.arm()) : 0,
                          .jumped = jumped,
                          .fresh = !started_ || jumped || risen || inside_};
    stamp_ = view.grid().increase_stamp();
    X_device_ = X_device;
    if (begun.fresh) {
      bristles_.reset();
      evaluated_.reset();
      // Where the jump ends in bone, the virtual tool follows from where it was.
      if (!started_ || inside_ || (jumped && !is_core_in_bone(view, bounds_, X_device))) X_ = X_device;
      inside_ = is_core_in_bone(view, bounds_, X_);
    }
    started_ = true;
    return begun;
  }

  /// Without contact at X.
  void set_free(const Posed& X) noexcept {
    X_ = X;
    way_.setZero();
    depth_ = 0;
    steps_ = 0;
    motion_.setZero();
    evaluated_.reset();
    bristles_.reset();
    contacts_.clear();
  }

  /// What the tool at X amounts to; nothing where the bone's surface there is not to be had yet.
  template <class View>
  [[nodiscard]] std::optional<PoseEnergy> evaluate(const View& view, const Posed& X, const ToolMotion& ahead) noexcept {
    if (!evaluated_ || X.matrix() != evaluated_->X.matrix()) {
      evaluated_.reset();
      if (!near_.cover(view, shape_, X, ahead)) return std::nullopt;
      evaluated_ = EvaluatedContact{X, foundation_.sum(near_, shape_, X, gains_.law)};
    }
    bristles_.attach(foundation_.points(), X, gains_.law.stiffness);
    return PoseEnergy{evaluated_->contact, bristles_.at(Vec6d::Zero()), gains_.coupling.at(X, X_device_),
                      gains_.coupling.turns};
  }

  template <class View>
  SearchResult search(const View& view, const Posed& X_device, double slid) noexcept {
    bristles_.begin(X_);
    // From where contact was looked at last, if all is as it was there.
    if (evaluated_ && !near_.is_current(view)) evaluated_.reset();
    Posed start = gains_.coupling.turns && evaluated_ ? evaluated_->X : X_;
    if (!gains_.coupling.turns) start.linear() = X_device.linear();
    PoseSearch search(
        gains_.coupling, X_device, bounds_,
        [&](const Posed& X, const ToolMotion& ahead) { return evaluate(view, X, ahead); }, bristles_);
    return search.from(
        start, {.least = kSmallestStep * gains_.voxel, .left = kOfMotion * std::min(slid, kMostSlid * gains_.voxel)},
        motion_);
  }

  void report(const SearchResult& found, Rendered<Scalar>& out) noexcept {
    // Free, but for what is less than the smallest step.
    if (found.ended && !found.at.contact.touches()) return set_free(X_device_);
    motion_ << found.X.translation() - X_.translation(), turn_between(X_, found.X);
    X_ = found.X;
    steps_ = found.steps;
    if (!evaluated_) foundation_.clear();
    const PoseError left = gains_.coupling.at(X_, X_device_);
    way_ = left.way;
    depth_ = found.at.contact.depth;
    report_contacts(found.last_step, out.contact);
    // A search that ran out in air, behind the device, has met nothing.
    if (!found.met) return;
    if (out.contact.count > 0) out.contact.depth = way_.norm() + depth_;
    const Vec6d felt = -VirtualCoupling::wrench(left);
    out.wrench = {felt.head<3>().template cast<Scalar>(), felt.tail<3>().template cast<Scalar>()};
  }

  void report_contacts(const Vec6d& last_step, ContactSummary& summary) noexcept {
    const std::span<const FoundationPoint> points = foundation_.points();
    const double k = gains_.law.stiffness;
    contacts_.clear();
    for (const FoundationPoint& before : points) {
      const FoundationPoint q = after(before, last_step);
      const double load = k * q.weight * q.depth;
      if (!(load > 0)) continue;
      const bool tip = q.arm.dot(X_.linear().col(2)) <= shape_.burr().shaft_emerges();
      summary.tip = summary.tip || tip;
      summary.shaft = summary.shaft || !tip;
      contacts_.add(q, load);
    }
    bristles_.settle(points, last_step,
                     [&](std::size_t i, const Vec3d& f) { contacts_.add_force(points[i].element, f); });
    contacts_.finish(X_.translation());
    summary.count = static_cast<int>(contacts_.contacts().size());
  }

  /// Contact as it was evaluated last, without friction.
  struct EvaluatedContact {
    Posed X;
    FoundationSum contact;
  };

  Shape shape_;
  ToolBounds bounds_;
  CoupledOptions options_;
  CoupledGains gains_;
  BroadPhase near_;
  Foundation foundation_;
  [[no_unique_address]] Bristles<FrictionLaw> bristles_;
  ContactList<Scalar> contacts_;

  // From tick to tick.
  Posed X_ = Posed::Identity();
  Posed X_device_ = Posed::Identity();
  Vec6d motion_ = Vec6d::Zero();  // of the virtual tool, in the last tick
  std::optional<EvaluatedContact> evaluated_;
  std::uint64_t stamp_ = 0;  // of densities that rose
  bool started_ = false;
  bool inside_ = false;  // the axis is in bone

  // Of the last tick.
  Vec3d way_ = Vec3d::Zero();  // from the virtual tool to the device [m]
  double depth_ = 0;           // of the deepest point [m]
  int steps_ = 0;
};

CoupledToolRenderer(Burr, CoupledOptions = {})->CoupledToolRenderer<double, BallAndShaft, Frictionless, SixDof>;
template <Friction FrictionLaw>
CoupledToolRenderer(Burr, CoupledOptions, FrictionLaw)
    -> CoupledToolRenderer<double, BallAndShaft, FrictionLaw, SixDof>;

}  // namespace trephine
