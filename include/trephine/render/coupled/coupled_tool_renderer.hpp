// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/cholesky.hpp>
#include <trephine/render/coupled/bristles.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/near_patches.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/voxel/gradient.hpp>
#include <trephine/voxel/known_air.hpp>

#include <cmath>
#include <utility>
#include <vector>

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
/// *Gains.* A ball pressed on a plane is held with a force in closed form (`BallOnPlane`). At the greatest force it is
/// a third of a voxel deep, or as deep as makes a footprint of kFootprint voxels radius where that is less; k follows.
/// The coupling's spring is stiffer by as much as contact yields, so that the two in series have `stiffness`
/// (`CompensatedSpring`).
///
/// *Work a tick*: Newton's steps with the exact second derivatives (Gauss and Newton's part alone where the rest makes
/// them indefinite), at most kMostSteps. A step is shortened where the energy rises or its slope turns, and lengthened
/// where the slope hardly changes. No step moves any part of the tool farther than the free way known plus half of its
/// core's radius, so no surface passes the tool's axis, which is where a point is pushed away from. Steps, or bricks to
/// make, that are left over are carried on at the next tick (`kWorkBound`).
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
  static constexpr int kMostSteps = 24;
  /// Radius [shortest spacings] of the contact on a plane at the greatest force: some ten voxels, a hundred points.
  static constexpr double kFootprint = 1.8;
  /// Most that the contact yields on a plane [shortest spacings].
  static constexpr double kMostYield = 1.0 / 3;
  /// A search ends with the step that is smaller than this share of what the device moved, or than kSmallestStep
  /// [shortest spacings]. The step is taken, so that what is left is a hundredth of the motion at most.
  static constexpr double kOfMotion = 0.05, kSmallestStep = 1e-6;
  /// A device whose axis turned farther between two ticks jumped [rad]: no hand turns as quickly, at 60 Hz either.
  static constexpr double kMostTurn = 0.5;
  /// A device that moved farther counts as moved by this [shortest spacings].
  static constexpr double kMostSlid = 0.5;

  /// Throws std::invalid_argument for options outside their range.
  CoupledToolRenderer(Shape shape, const CoupledOptions& options = {}, const FrictionLaw& friction = FrictionLaw{})
      : shape_(std::move(shape)),
        bounds_(shape_.bounds()),
        options_(options),
        cutting_burr_(shape_.burr()),
        bristles_(friction) {
    options.validate();
  }

  /// Takes memory for the tool in voxels of this bone; a scene calls it once, before its first tick.
  template <class View>
  void prepare(const View& view) {
    tune(view);
    // Contact begins `offset` outside the tool, and chords of a ball's surface sag: by h² / 8R in the middle of a
    // voxel's diagonal h, by a third of that on the mean.
    const double R = shape_.burr().tip_radius;
    cutting_burr_.tip_radius = R + law_.offset + view.grid().spacing().squaredNorm() / (24 * R);
    near_.reserve(view, shape_);
    // Half a voxel apart where a contact has kFootprint voxels, and nearer where patches are long or it is small.
    const double footprint = std::sqrt(2 * R * yield_), side = view.surface().longest_part();
    const double skewed = view.grid().spacing().maxCoeff() < kSkewed * voxel_ ? 1 : kSkewed;
    foundation_ = Foundation(
        static_cast<std::size_t>(std::ceil(2 * kFootprint * skewed * side / footprint - kRounding)), kMostPoints);
    bristles_.reserve(near_.capacity(), kMostContacts, foundation_.side() * foundation_.side());
    contacts_.resize(kMostContacts);
    touched_.resize(kMostContacts);
  }

  template <class View>
  Rendered<Scalar> render(const View& view, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> out;
    const Posed X_device = X_GT.template cast<double>();
    view.surface().begin_tick();
    out.status = begin(view, X_device);
    if (inside_) {
      rest_at(X_device);
      out.status = worse(out.status, Status::kStartedInside);
      return out;
    }
    if (!search(view, X_device)) out.status = worse(out.status, Status::kWorkBound);
    if (fresh_ && begun_in_contact_) out.status = worse(out.status, Status::kStartedInside);
    report(out);
    return out;
  }

  void reset() noexcept {
    started_ = false;
    inside_ = false;
    near_.forget();
    rest_at(X_);
  }

  [[nodiscard]] const CoupledOptions& options() const noexcept { return options_; }
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  [[nodiscard]] double rotational_stiffness() const noexcept { return options_.rotational_stiffness; }
  /// How deep the deepest point of the bone's surface is in the virtual tool [m].
  [[nodiscard]] double penetration() const noexcept { return contact_.depth; }
  /// Newton's steps that the last tick took.
  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// The pressure of bone on the tool; known once a scene is made.
  [[nodiscard]] const FoundationLaw& foundation_law() const noexcept { return law_; }
  [[nodiscard]] const Shape& tool() const noexcept { return shape_; }
  /// The burr that cuts: a little larger than the tool's, so that the tool fits into what it cut.
  [[nodiscard]] const Burr& shape() const noexcept { return cutting_burr_; }
  /// One for each patch of the bone's surface that touches, friction included.
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// The virtual tool.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_.template cast<Scalar>(); }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return proxy_pose(); }
  /// The virtual tool and its bite.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept {
    const double most = options_.bite * voxel_, way = error_.way.norm();
    Posed X = X_;
    X.translation() += way > most ? Vec3d(error_.way * (most / way)) : error_.way;
    return X.template cast<Scalar>();
  }

 private:
  static constexpr std::size_t kMostPoints = 16384, kMostContacts = 2048;
  /// Voxels longer than this times their width have patches askew, longer by as much along their diagonals.
  static constexpr double kSkewed = 1.5;
  /// A tick evaluates contact this many times, and a step's trials more, at most.
  static constexpr int kMostEvaluations = 64;
  static constexpr int kMostTrials = 8;  ///< along a step
  /// A step ends where the energy's slope along it is between these shares of what it began with.
  static constexpr double kSteep = 0.5, kFlat = 0.9;
  /// Relative rise of the energy that is rounding.
  static constexpr double kRounding = 1e-9;
  /// A tool that appears with bone deeper in it than this [shortest spacings] is in contact.
  static constexpr double kTouching = 0.1;
  /// The list of near patches reaches this far at least and at most [shortest spacings] beyond what can touch.
  static constexpr double kLeastReach = 2, kMostReach = 8;

  /// What is left from the virtual tool to the device [m, rad].
  struct PoseError {
    Vec3d way = Vec3d::Zero();
    Vec3d turn = Vec3d::Zero();
  };

  struct Touched {
    std::size_t patch = 0;         // of the near patches
    double load = 0;               // [N]
    Vec3d moment = Vec3d::Zero();  // Σ load · arm
  };

  /// Whether the virtual tool finds its rotation by itself.
  [[nodiscard]] bool turns() const noexcept {
    return Motion::kDof == 6 && std::isfinite(options_.rotational_stiffness);
  }
  [[nodiscard]] SpringPull twist(double turn) const noexcept {
    return BoundedSpring{options_.rotational_stiffness, options_.torque}.at(turn);
  }

  template <class View>
  void tune(const View& view) noexcept {
    voxel_ = view.grid().spacing().minCoeff();
    const double R = shape_.burr().tip_radius, a = kFootprint * voxel_;
    // A contact softer than the coupling could not be made up for.
    yield_ = std::min({kMostYield * voxel_, a * a / (2 * R), R / 4, options_.force / options_.stiffness / 4});
    // Depths on a ball's contact slope by √(2δ/R) at its rim, and a point's cell is half a voxel wide.
    const double ramp = 0.5 * voxel_ * std::sqrt(2 * yield_ / R);
    const double gain = options_.force / BallOnPlane{1, R, ramp}.force(yield_);
    spring_ = CompensatedSpring(options_.stiffness, {gain, R, ramp}, yield_);
    law_ = {gain / kPi, ramp, spring_.offset()};
  }

  /// Whether the tool's axis, as far as its core reaches, is in bone somewhere.
  template <class View>
  [[nodiscard]] bool is_core_in_bone(const View& view, const Posed& X) const noexcept {
    constexpr int kMostSamples = 1000;
    const Vec3d u = X.linear().col(2);
    const double first = bounds_.z_low + bounds_.core_radius;
    const double length = std::max(0.0, bounds_.z_high - bounds_.core_radius - first);
    const int n = std::min(kMostSamples, static_cast<int>(length / view.grid().spacing().minCoeff()) + 1);
    for (int i = 0; i <= n; ++i)
      if (view.surface().is_bone(X.translation() + (first + length * i / n) * u)) return true;
    return false;
  }

  template <class View>
  Status begin(const View& view, const Posed& X_device) noexcept {
    const bool jumped = started_ && !((X_device.translation() - X_device_.translation()).norm() <= options_.jump &&
                                      (X_device.linear().col(2) - X_device_.linear().col(2)).norm() <= kMostTurn);
    const bool risen = started_ && stamp_ != view.grid().rise_stamp();
    stamp_ = view.grid().rise_stamp();
    slid_ = started_ ? NearPatches::motion_between(bounds_, X_device_, X_device) : 0;
    X_device_ = X_device;
    fresh_ = !started_ || jumped || risen || inside_;
    if (fresh_) {
      bristles_.reset();
      known_ = false;
      // Where the jump ends in bone, the virtual tool follows from where it was.
      if (!started_ || inside_ || (jumped && !is_core_in_bone(view, X_device))) X_ = X_device;
      inside_ = is_core_in_bone(view, X_);
    }
    started_ = true;
    return jumped ? Status::kJump : Status::kOk;
  }

  /// Without contact at X.
  void rest_at(const Posed& X) noexcept {
    X_ = X;
    error_ = {};
    contact_ = {};
    met_ = false;
    last_step_.setZero();
    foundation_.clear();
    known_ = false;
    bristles_.reset();
    contact_count_ = 0;
    steps_ = 0;
  }

  [[nodiscard]] PoseError error_at(const Posed& X) const noexcept {
    return {X_device_.translation() - X.translation(), turn_between(X, X_device_)};
  }
  [[nodiscard]] static Posed moved(const Posed& X, const Vec6d& step) noexcept {
    const Vec3d turn = step.tail<3>();
    return make_pose<double>(rotation_from_vector(turn) * X.linear(), X.translation() + step.head<3>());
  }

  /// How far to look for a tool that may go on by `ahead` [m].
  [[nodiscard]] double reach_for(double ahead) const noexcept {
    return std::clamp(ahead, kLeastReach * voxel_, kMostReach * voxel_);
  }

  /// Contact, pose error and energy with the tool at X; false where the bone's surface there is not to be had yet.
  template <class View>
  [[nodiscard]] bool evaluate(const View& view, const Posed& X, double ahead) noexcept {
    if (!known_) {
      if (!near_.cover(view, shape_, X, 0, reach_for(ahead))) return false;
      bristles_.follow(near_);
      pressed_ = foundation_.sum(near_, shape_, X, law_);
    }
    ++evaluations_;
    known_ = false;
    X_known_ = X;
    contact_ = pressed_;
    met_ = met_ || !foundation_.points().empty();
    bristles_.add_to(contact_, foundation_.points(), X, law_.stiffness);
    error_ = error_at(X);
    pull_ = spring_.at(error_.way.norm());
    energy_ = contact_.energy + pull_.energy + (turns() ? twist(error_.turn.norm()).energy : 0.0);
    return true;
  }

  /// Whether no bone is near a tool that goes from its pose to the device's, for less than a look at the bone costs.
  template <class View>
  [[nodiscard]] bool is_clear(const View& view) const noexcept {
    const double motion = NearPatches::motion_between(bounds_, X_, X_device_);
    if (near_.is_empty_around(view, bounds_, X_, motion)) return true;
    if constexpr (KnowsAir<View> || KnowsBeyond<View>) {
      // Balls about points of the axis, until they hold the tool.
      constexpr int kMostBalls = 8;
      const Vec3d u = X_.linear().col(2);
      const double radius = (bounds_.z_high - bounds_.z_low) / 2 + bounds_.radius + motion + voxel_;
      const double middle = (bounds_.z_high + bounds_.z_low) / 2;
      if (is_known_clear<View, double>(view, X_.translation() + middle * u, radius)) return true;
      if constexpr (KnowsAir<View>) {
        double z = bounds_.z_low;
        for (int i = 0; i < kMostBalls; ++i) {
          const double air = view.template air_around<double>(X_.translation() + z * u) - bounds_.radius - motion;
          if (!(air > voxel_)) return false;
          z += air;
          if (z > bounds_.z_high) return true;
        }
      }
    }
    return false;
  }

  /// Newton's steps toward the least energy. Returns whether they got there.
  template <class View>
  bool search(const View& view, const Posed& X_device) noexcept {
    begun_in_contact_ = false;
    if (is_clear(view)) {
      rest_at(X_device);
      return true;
    }
    bristles_.begin(X_);
    last_step_.setZero();
    steps_ = 0;
    evaluations_ = 0;
    met_ = false;
    // From where contact was looked at last, if all is as it was there.
    if (turns() && known_ && near_.is_current(view))
      X_ = X_known_;
    else
      known_ = false;
    if (!turns()) X_.linear() = X_device.linear();
    double ahead = NearPatches::motion_between(bounds_, X_, X_device);
    if (!evaluate(view, X_, ahead)) return give_up();
    begun_in_contact_ = contact_.depth > kTouching * voxel_;
    const double least = kSmallestStep * voxel_, share = kOfMotion * std::min(slid_, kMostSlid * voxel_);
    for (steps_ = 1; steps_ <= kMostSteps && evaluations_ <= kMostEvaluations; ++steps_) {
      if (foundation_.points().empty() && NearPatches::motion_between(bounds_, X_, X_device) <= contact_.nearest) {
        rest_at(X_device);
        return true;
      }
      const Vec6d step = next_step();
      const Posed X_next = moved(X_, step);
      const double motion = NearPatches::motion_between(bounds_, X_, X_next);
      const double size = motion + step.tail<3>().norm() * bounds_.radius;
      // A step as long as the contact is deep may end it.
      if (size <= std::max(least, std::min(share, contact_.depth))) {
        X_ = X_next;
        last_step_ = step;
        error_ = error_at(X_);
        known_ = true;
        return true;
      }
      if (!descend(view, step, motion)) return give_up();
    }
    return false;
  }

  /// Goes along the step to where the energy is lower and its slope small; false where the bone's surface there is not
  /// to be had yet. Stays where it is when it finds none.
  template <class View>
  [[nodiscard]] bool descend(const View& view, const Vec6d& step, double motion) noexcept {
    const double free = contact_.nearest + bounds_.core_radius / 2, most = motion > 0 ? free / motion : 1.0;
    const Posed X_before = X_;
    const double before = energy_, slope = -force().dot(step);
    double low = 0, low_slope = slope, high = std::numeric_limits<double>::infinity(), high_slope = 0;
    double t = std::min(1.0, most);
    for (int trials = 0; trials < kMostTrials; ++trials) {
      X_ = moved(X_before, t * step);
      if (!evaluate(view, X_, (1 - t) * motion)) {
        X_ = X_before;
        return false;
      }
      const double here = -force().dot(step);
      // Friction has no energy: whether its forces point back decides.
      const bool conserves = !bristles_.holds();
      if ((conserves && energy_ > before + kRounding * std::abs(before)) || here > -kSteep * slope) {
        high = t;
        high_slope = here;
      } else if (conserves && here < kFlat * slope && t < most && t < high) {
        low = t;
        low_slope = here;
      } else {
        return true;
      }
      if (high == std::numeric_limits<double>::infinity()) {
        t = std::min(2 * t, most);
      } else {
        const double secant = high_slope > 0 ? low_slope / (low_slope - high_slope) : 0.5;
        t = low + std::clamp(secant, 0.1, 0.9) * (high - low);
      }
    }
    if (bristles_.holds() || energy_ <= before) return true;
    X_ = X_before;
    return evaluate(view, X_, 0);
  }

  /// The virtual tool stays where it is, and what it touches is not known.
  bool give_up() noexcept {
    foundation_.clear();
    known_ = false;
    error_ = error_at(X_);
    return false;
  }

  /// −∂E by a small motion (δp, δθ) of the virtual tool.
  [[nodiscard]] Vec6d force() const noexcept {
    Vec6d f = contact_.wrench;
    const double way = error_.way.norm(), turn = error_.turn.norm();
    if (way > 0) f.head<3>() += pull_.pull / way * error_.way;
    if (!turns())
      f.tail<3>().setZero();
    else if (turn > 0)
      f.tail<3>() += twist(turn).pull / turn * error_.turn;
    return f;
  }

  /// The small motion (δp, δθ) of the virtual tool by which Newton's method goes on.
  [[nodiscard]] Vec6d next_step() const noexcept {
    const Vec6d f = force();
    Mat6d H = contact_.stiffness;
    const double way = error_.way.norm();
    const SpringPull p = pull_;
    const double secant = way > 0 ? p.pull / way : p.tangent;
    // A pull that grows no more has no stiffness along it: the secant keeps the step bounded, and downhill.
    const double along = p.tangent > 0 ? p.tangent : secant;
    const Vec3d d = way > 0 ? Vec3d(error_.way / way) : Vec3d(Vec3d::Zero());
    H.topLeftCorner<3, 3>() += secant * Mat3d::Identity() + (along - secant) * d * d.transpose();
    Mat6d bending = contact_.bending;
    if (turns()) {
      const double turn = error_.turn.norm();
      const double k = turn > 0 ? twist(turn).pull / turn : options_.rotational_stiffness;
      // Second derivative of ½|log|²: 1 along the turn, (φ/2) cot (φ/2) across.
      const double across = turn > 1e-4 ? (turn / 2) / std::tan(turn / 2) : 1.0;
      const Vec3d a = turn > 0 ? Vec3d(error_.turn / turn) : Vec3d(Vec3d::Zero());
      H.bottomRightCorner<3, 3>() += k * Mat3d::Identity();
      bending.bottomRightCorner<3, 3>() -= k * (1 - across) * (Mat3d::Identity() - a * a.transpose());
    } else {
      H.bottomRows<3>().setZero();
      H.rightCols<3>().setZero();
      H.diagonal().tail<3>().setOnes();
      bending.bottomRows<3>().setZero();
      bending.rightCols<3>().setZero();
    }
    Vec6d step = Vec6d::Zero();
    if (!solve_positive_definite<6>(H + bending, f, step)) static_cast<void>(solve_positive_definite<6>(H, f, step));
    return step;
  }

  void report(Rendered<Scalar>& out) noexcept {
    const double way = error_.way.norm(), turn = error_.turn.norm();
    contact_count_ = 0;
    const std::span<const FoundationPoint> points = foundation_.points();
    for (const FoundationPoint& q : points) add_contact(after(q, last_step_), out.contact);
    std::size_t at = 0;
    bristles_.settle(points, last_step_, near_, X_, law_.stiffness, [&](std::size_t i, const Vec3d& f) {
      while (at < contact_count_ && touched_[at].patch < points[i].patch) ++at;
      if (at < contact_count_ && touched_[at].patch == points[i].patch)
        contacts_[at].force += f.template cast<Scalar>();
    });
    for (std::size_t i = 0; i < contact_count_; ++i) {
      ContactPoint<Scalar>& c = contacts_[i];
      c.position = (X_.translation() + touched_[i].moment / touched_[i].load).template cast<Scalar>();
      c.normal.normalize();
    }
    out.contact.count = static_cast<int>(contact_count_);
    // A search that ran out in air, behind the device, has met nothing.
    if (!met_) return;
    if (!points.empty()) out.contact.depth = way + contact_.depth;
    if (way > 0) out.wrench.force = (-spring_.at(way).pull / way * error_.way).template cast<Scalar>();
    if (turns() && turn > 0) out.wrench.torque = (-twist(turn).pull / turn * error_.turn).template cast<Scalar>();
  }

  /// Joins the point to its patch's contact, which sums normals by load until `report` scales them.
  void add_contact(const FoundationPoint& q, ContactSummary& summary) noexcept {
    const double load = law_.stiffness * q.weight * q.depth;
    if (!(load > 0)) return;
    const bool tip = q.arm.dot(X_.linear().col(2)) <= shape_.burr().shaft_emerges();
    summary.tip = summary.tip || tip;
    summary.shaft = summary.shaft || !tip;
    if (contact_count_ == 0 || touched_[contact_count_ - 1].patch != q.patch) {
      if (contact_count_ == contacts_.size()) return;
      touched_[contact_count_] = {.patch = q.patch};
      contacts_[contact_count_++] = {};
    }
    Touched& t = touched_[contact_count_ - 1];
    t.load += load;
    t.moment += load * q.arm;
    ContactPoint<Scalar>& c = contacts_[contact_count_ - 1];
    const Vec3<Scalar> f = (-load * q.normal).template cast<Scalar>();
    c.normal += f;
    c.force += f;
  }

  static constexpr double kPi = 3.14159265358979323846;

  Shape shape_;
  ToolBounds bounds_;
  CoupledOptions options_;
  Burr cutting_burr_;
  [[no_unique_address]] Bristles<FrictionLaw> bristles_;
  NearPatches near_;
  Foundation foundation_;
  Posed X_ = Posed::Identity();
  Posed X_device_ = Posed::Identity();
  // At X_, and what the last step, after which none looked, still moved.
  PoseError error_;
  FoundationSum contact_;
  Posed X_known_ = Posed::Identity();  // where contact was evaluated last,
  FoundationSum pressed_;              // what came out, without friction,
  bool known_ = false;                 // and whether a search ended there
  double energy_ = 0;
  SpringPull pull_;  // of the pose error
  Vec6d last_step_ = Vec6d::Zero();

  double slid_ = 0;  // what the device moved since the last tick [m]
  std::uint64_t stamp_ = 0;
  bool started_ = false;
  bool inside_ = false;            // the axis is in bone
  bool fresh_ = false;             // nothing is known of what touched before this tick
  bool begun_in_contact_ = false;  // this tick
  bool met_ = false;               // bone, in this search
  int steps_ = 0;
  int evaluations_ = 0;
  double voxel_ = 0;  // shortest spacing [m]
  double yield_ = 0;  // of a contact on a plane at the greatest force [m]
  FoundationLaw law_{};
  CompensatedSpring spring_;
  std::size_t contact_count_ = 0;
  std::vector<ContactPoint<Scalar>> contacts_;
  std::vector<Touched> touched_;  // of each contact
};

CoupledToolRenderer(Burr, CoupledOptions = {})->CoupledToolRenderer<double, BallAndShaft, Frictionless, SixDof>;
template <Friction FrictionLaw>
CoupledToolRenderer(Burr, CoupledOptions, FrictionLaw)
    -> CoupledToolRenderer<double, BallAndShaft, FrictionLaw, SixDof>;

}  // namespace trephine
