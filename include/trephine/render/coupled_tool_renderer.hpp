// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/contact/rolling.hpp>
#include <trephine/contact/vertex_contacts.hpp>
#include <trephine/render/contact_friction.hpp>
#include <trephine/render/coupled_options.hpp>
#include <trephine/render/depth_source.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/render/virtual_coupling.hpp>

#include <Eigen/Cholesky>

#include <cstdint>
#include <utility>
#include <vector>

namespace trephine {

/// The whole tool as a proxy: a static virtual coupling (Wan and McNeely 2003; Barbič and James 2008). The virtual
/// tool's pose X minimises
///
///     E(X) = ½ k_c Σ w_i φ_i(X)² + ½ k_v |p − p_dev|² + ½ k_θ |log(R_dev Rᵀ)|²
///
/// over the vertices in bone, φ_i their depth, w_i their share where several find the same place, and the hand feels
/// the coupling alone: its stiffness is bounded whatever touches, force and torque come from one energy, deep pushing
/// is allowed and the drawn tool does not sink in.
///
/// *Gains.* k_c of each place is such that one alone holds the coupling's greatest force a twentieth of a voxel deep (a
/// quarter with friction), and at least 50 k_v. A wall that an image shows a tenth of a voxel deep in its middle so
/// holds twice what the coupling can pull.
///
/// *Work a tick*: Gauss–Newton steps, at most kMostSteps, from the last pose or, sliding without friction, from where
/// that motion leads; each with a batch of samples of the vertices within a voxel of bone, and of other slices only
/// once they may have come near or what is remembered of them would shorten a step; at most eight smoothed samples more
/// for each vertex on an edge, three or four on a face, three from where its patch was deepest before, and one for each
/// place that held the ball when the last tick ended and is deepest no more. No step moves a vertex farther than a
/// quarter of a voxel beyond what is known to be free, a steady slide half of one, so none passes a wall unseen. What
/// is left when the steps run out is carried on at the next tick (`kWorkBound`).
///
/// *Statuses*: kJump (see options), kStartedInside as long as the virtual tool is deeper than a voxel in bone (a start
/// there, a restore): it moves out step by step while a way out is known.
///
/// Friction: at each vertex a spring to where it stuck, within Coulomb's cone (`Coulomb`); `Frictionless` costs
/// nothing.
template <RealScalar S, DepthSource Depth = FromDepthMap, Friction FrictionLaw = Frictionless,
          CoupledMotion Motion = SixDof>
class CoupledToolRenderer : public DepthReader<S, Depth> {
 public:
  using Scalar = S;
  using Gradient = AnalyticGradient;
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;
  static constexpr int kMostSteps = 24;
  /// Farther behind than this [voxels] after a jump the virtual tool starts anew where the device is: it would take 50
  /// ticks to follow.
  static constexpr double kFarthestFollow = 300;
  /// [voxels]: motion below it, or below kOfSlide of what a tool in a steady slide moves, ends a tick's search, of what
  /// touches and of what the coupling weighs. Vertices that touch nothing have no say in it: a shaft in air changes no
  /// bit of what a tool without one answers, as long as no step takes it farther than the depths know to be free.
  static constexpr double kSmallestStep = 1e-3, kOfSlide = 0.02;

  /// Throws std::invalid_argument for options outside their range.
  CoupledToolRenderer(Tool tool, Depth depth, const CoupledOptions& options = {},
                      const FrictionLaw& friction = FrictionLaw{})
      : DepthReader<S, Depth>(depth),
        tool_(std::move(tool)),
        options_(options),
        friction_(friction, static_cast<std::size_t>(tool_.periphery())),
        vertices_(tool_) {
    options.validate();
    const auto most = vertices_.most();
    contacts_.resize(most);
    pressed_.resize(most);
    ways_.resize(most);
  }

  template <PenetrationField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> out;
    voxel_ = static_cast<double>(field.voxel());
    contact_stiffness_ = options_.contact_stiffness(voxel_, friction_.holds());
    const Posed X_device = X_GT.template cast<double>();
    out.status = begin(field, X_device);
    if (!follow(field, X_device)) out.status = worse(out.status, Status::kWorkBound);
    if (vertices_.deepest() > voxel_) out.status = worse(out.status, Status::kStartedInside);
    report(out);
    return out;
  }

  void reset() noexcept {
    started_ = false;
    met_ = false;
    contact_count_ = 0;
    vertices_.reset();
    friction_.reset();
  }

  [[nodiscard]] const CoupledOptions& options() const noexcept { return options_; }
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  [[nodiscard]] double rotational_stiffness() const noexcept { return options_.rotational_stiffness; }
  /// k_c of one vertex [N/m] in the last tick's field.
  [[nodiscard]] double contact_stiffness() const noexcept { return contact_stiffness_; }
  /// How deep the virtual tool's deepest vertex is [m].
  [[nodiscard]] double penetration() const noexcept { return vertices_.deepest(); }
  /// Steps that the last tick took.
  [[nodiscard]] int steps() const noexcept { return steps_; }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// The virtual tool.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_.template cast<Scalar>(); }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return proxy_pose(); }
  /// The virtual tool and its bite.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept {
    const Vec3d& pull = lag_.way;
    const double most = options_.bite * voxel_;
    Posed X = X_;
    if (met_) X.translation() += pull.norm() > most ? Vec3d(pull * (most / pull.norm())) : pull;
    return X.template cast<Scalar>();
  }

 private:
  static constexpr int kDof = Motion::kDof;
  using VecN = Eigen::Matrix<double, kDof, 1>;
  using Step = Eigen::Matrix<double, 6, 1>;
  // Where a contact comes and goes the energy has a kink: to and fro across it there is no more to win.
  static constexpr int kMostRises = 3;
  static constexpr int kMostRounds = 8;
  static constexpr double kStall = 1e-5;
  // Of the energy, more by which a search does not end higher than it began: what places that glide by the image's
  // gradients, not quite to the deepest point, leave open.
  static constexpr double kRounding = 1e-2, kRoundingWithFriction = 1e-3;
  static constexpr double kSlides = 0.1;  // of a motion, at most that much into or out of what touches
  static constexpr double kBends = 0.2;   // likewise, changed since the tick before: more is not steady
  using MatN = Eigen::Matrix<double, kDof, kDof>;

  [[nodiscard]] double smallest_step() const noexcept { return std::max(kSmallestStep * voxel_, kOfSlide * slide_); }
  /// Whether the virtual tool finds its rotation by itself.
  [[nodiscard]] bool turns() const noexcept { return kDof == 6 && std::isfinite(options_.rotational_stiffness); }
  [[nodiscard]] CouplingSpring coupling() const noexcept {
    return {options_.stiffness, turns() ? options_.rotational_stiffness : 0, options_.force, options_.torque};
  }
  /// Where a turn takes as much energy as the way that it leads through [m]; at the ball, if it takes none.
  [[nodiscard]] double coupling_lever() const noexcept {
    return turns() ? std::sqrt(options_.rotational_stiffness / options_.stiffness) : tool_.burr().tip_radius;
  }
  /// How much less deep a step leads a place whose −∂φ/∂pose is J.
  [[nodiscard]] double rise(const VecN& J, const Step& step) const noexcept {
    const double by_way = J.template head<3>().dot(step.template head<3>());
    if constexpr (kDof == 6)
      if (turns()) return by_way + J.template tail<3>().dot(step.template tail<3>());
    return by_way;
  }

  template <class Field>
  Status begin(const Field& field, const Posed& X_device) noexcept {
    const bool jumped = started_ && !((X_device.translation() - X_device_.translation()).norm() <= options_.jump);
    if (!started_) X_ = X_device;
    X_device_ = X_device;
    if (jumped) {
      vertices_.look(field, tool_, X_device);
      const bool far = !((X_device.translation() - X_.translation()).norm() <= kFarthestFollow * voxel_);
      if (vertices_.found().empty() || far) X_ = X_device;
    }
    if (!started_ || jumped) {
      friction_.reset();
      X_before_ = X_;
      drift_before_.setZero();
    }
    friction_.begin(X_);
    vertices_.begin();
    predict(field);
    started_ = true;
    return jumped ? Status::kJump : Status::kOk;
  }

  /// A tool that slides along what it touches starts where it comes to if it goes on as in the last tick, and in a
  /// steady slide as in the last two, round bends too, which is nearly all of the way. Not one that is pressed or
  /// lifted, nor one that friction may hold: there what is left over when the search ends would run ahead of the hand.
  template <class Field>
  void predict(const Field& field) noexcept {
    slide_ = 0;
    if (friction_.holds()) return;
    Step drift;
    drift << X_.translation() - X_before_.translation(), turn_between(X_before_, X_);
    X_before_ = X_;
    const Step change = drift - std::exchange(drift_before_, drift);
    const bool steady = change.squaredNorm() < kBends * kBends * drift.squaredNorm();
    if (steady) drift += change;
    const double way = drift.head<3>().norm(), turn = drift.tail<3>().norm();
    const double motion = way + turn * lever_;
    if (motion <= kSmallestStep * voxel_) return;
    for (const VertexContact& c : vertices_.near())
      if (std::abs(c.out.dot(drift.head<3>()) + c.moment().dot(drift.tail<3>())) > kSlides * motion) return;
    if (steady) slide_ = motion;
    const double share = steady ? vertices_.slide_share(field, tool_, drift.head<3>(), drift.tail<3>(), voxel_ / 4)
                                : vertices_.free_share(field, tool_, way, turn, voxel_ / 4);
    X_ = moved(X_, share * drift);
  }

  /// Gauss–Newton toward the least energy. Returns whether it got there. Steps into contact overshoot by a quarter of a
  /// voxel at most and the next one comes back; where contacts change to and fro, steps are damped.
  template <class Field>
  bool follow(const Field& field, const Posed& X_device) noexcept {
    vertices_.look(field, tool_, X_);
    lag_ = lag_behind(X_device);
    friction_.enter(vertices_.found(), X_);
    met_ = !vertices_.found().empty();
    held_ = false;
    double now = energy();
    double damping = 1;
    int rises = 0;
    Best best{X_, now};
    for (steps_ = 1; steps_ <= kMostSteps; ++steps_) {
      const Step step = next_step();
      const double way = damping * step.template head<3>().norm(), turn = damping * step.template tail<3>().norm();
      met_ = met_ || pressing_;
      if (way + turn * lever_ <= smallest_step()) {
        if (rest_at(field, best, now, X_device)) return true;
        last_step_ = damping * step;
        X_ = moved(X_, last_step_);
        lag_ = lag_behind(X_device);
        held_ = pressing_;
        return true;
      }
      const double share = vertices_.free_share(field, tool_, way, turn, voxel_ / 4);
      const bool limited = share < 1;
      const bool touched = !vertices_.found().empty();
      X_ = moved(X_, damping * share * step);
      vertices_.look(field, tool_, X_);
      friction_.enter(vertices_.found(), X_);
      lag_ = lag_behind(X_device);
      const double before = std::exchange(now, energy());
      met_ = met_ || !vertices_.found().empty();
      if (!limited && !touched && !pressing_ && vertices_.found().empty()) return true;
      if (!friction_.holds() && now < best.energy) best = {X_, now};
      const bool stalls = !limited && std::abs(now - before) <= kStall * before;
      if (now > before && ++rises > 1) damping /= 2;
      if (stalls || rises == kMostRises) {
        rest_at(field, best, now, X_device);
        return true;
      }
    }
    rest_at(field, best, now, X_device);
    return false;
  }

  /// A pose that a search may end at, and E there: without friction the best on its way, with friction, whose forces
  /// have no energy to be least, the first.
  struct Best {
    Posed X;
    double energy;
  };

  /// Ends a search there where it came to higher energy: a tool at rest then stays there tick by tick, and none moves
  /// against the coupling, which would give the hand energy. Returns whether that was so.
  template <class Field>
  bool rest_at(const Field& field, const Best& best, double now, const Posed& X_device) noexcept {
    const double rounding = friction_.holds() ? kRoundingWithFriction : kRounding;
    if (!(now > best.energy * (1 + rounding))) return false;
    X_ = best.X;
    vertices_.look(field, tool_, X_);
    lag_ = lag_behind(X_device);
    return true;
  }

  /// What is left from the virtual tool to the device [m, rad].
  struct Lag {
    Vec3d way = Vec3d::Zero();
    Vec3d turn = Vec3d::Zero();
  };
  [[nodiscard]] Lag lag_behind(const Posed& X_device) const noexcept {
    return {X_device.translation() - X_.translation(), turn_between(X_, X_device)};
  }

  [[nodiscard]] static Posed moved(const Posed& X, const Step& step) noexcept {
    const Vec3d turn = step.tail<3>();
    return make_pose<double>(rotation_from_vector(turn) * X.linear(), X.translation() + step.head<3>());
  }

  /// E at the virtual tool's pose, whose contacts and lag are known, with what friction's springs hold.
  [[nodiscard]] double energy() const noexcept {
    double sum = 0;
    for (const VertexContact& c : vertices_.found()) sum += c.weight * (c.depth * c.depth + friction_.energy(c, X_));
    return 0.5 * contact_stiffness_ * sum + coupling().energy(lag_.way.norm(), turns() ? lag_.turn.norm() : 0.0);
  }

  /// Translation and rotation [m, rad] of the virtual tool that a Gauss–Newton step asks for.
  [[nodiscard]] Step next_step() noexcept {
    const Vec3d& pull = lag_.way;
    const Vec3d& turn = lag_.turn;
    Step step;
    step.template head<3>() = pull;
    step.template tail<3>() = turn;
    pressing_ = false;
    lever_ = coupling_lever();
    if (vertices_.near().empty()) return step;

    // One-sided springs of the places in bone and of those near it, linear in the step: which of them the step presses
    // is found by solving again while that changes.
    std::size_t count = 0;
    for (const VertexContact& c : vertices_.near()) {
      VecN& J = ways_[count++];
      J.template head<3>() = c.out;
      if constexpr (kDof == 6) J.template tail<3>() = c.moment();
    }
    const CouplingSpring spring = coupling();
    const double k_linear = spring.linear(pull.norm());
    const double k_angular = spring.angular(turn.norm());
    for (int round = 0; round < kMostRounds; ++round) {
      MatN H = MatN::Zero();
      VecN residual;
      H.diagonal().template head<3>().setConstant(k_linear);
      residual.template head<3>() = k_linear * pull;
      if constexpr (kDof == 6) {
        H.diagonal().template tail<3>().setConstant(k_angular);
        residual.template tail<3>() = k_angular * turn;
      }
      std::size_t changes = 0;
      std::size_t n = 0;
      for (const VertexContact& c : vertices_.near()) {
        const VecN& J = ways_[n];
        const double depth = round == 0 ? c.depth : c.depth - rise(J, step);
        // Later rounds only add: they come to an end.
        const std::uint8_t pressed = depth > 0 || (round > 2 && pressed_[n] != 0) ? 1 : 0;
        if (pressed != pressed_[n]) ++changes;
        pressed_[n++] = pressed;
        if (pressed == 0) continue;
        pressing_ = true;
        const double k = contact_stiffness_ * c.weight;
        H.noalias() += (k * J) * J.transpose();
        residual += (k * c.depth) * J;
        if (c.depth > 0) friction_.add(c, X_, k, H, residual);
      }
      if (round > 0 && changes == 0) break;
      add_rolling(vertices_.found(), contact_stiffness_, tool_.burr().tip_radius, k_linear, pull.norm(), H);
      if constexpr (kDof == 6)
        if (!turns()) hold_rotation(H, residual);
      step.template head<kDof>() = H.template selfadjointView<Eigen::Lower>().llt().solve(residual);
      if (!turns()) step.template tail<3>() = turn;
    }
    std::size_t n = 0;
    for (const VertexContact& c : vertices_.near())
      if (pressed_[n++] != 0) lever_ = std::max(lever_, c.lever.norm());
    return step;
  }

  /// Leaves of a system what is in translation, to the bits of one that has no more.
  static void hold_rotation(MatN& H, VecN& residual) noexcept requires(kDof == 6) {
    H.template bottomRows<3>().setZero();
    H.template rightCols<3>().setZero();
    H.diagonal().template tail<3>().setOnes();
    residual.template tail<3>().setZero();
  }

  void report(Rendered<Scalar>& out) noexcept {
    contact_count_ = 0;
    const CouplingSpring spring = coupling();
    const Vec3d force = -spring.linear(lag_.way.norm()) * lag_.way;
    std::size_t n = 0;
    const VertexContact* nearest = nullptr;
    const auto add = [&](const VertexContact& c, const Vec3d& f) {
      contacts_[contact_count_++] = contact_point<Scalar>(c, X_.translation(), f);
      vertices_.tell(c, out.contact);
    };
    for (const VertexContact& c : vertices_.near()) {
      // The last step of a search, too small to look again after, may be what presses a place a hair's breadth outside.
      const double depth = held_ ? c.depth - rise(ways_[n], last_step_) : c.depth;
      const bool touches = c.depth > 0;
      const bool holds = held_ && pressed_[n] != 0;
      ++n;
      if (!nearest || c.depth > nearest->depth) nearest = &c;
      if (!touches && !holds) continue;
      VertexContact there = c;
      if (held_) {
        there.depth = std::max(0.0, depth);
        if (c.turns) there.lever += last_step_.template tail<3>().cross(c.lever);
      }
      const Vec3d rubs = touches ? friction_.settle(there, X_) : Vec3d(Vec3d::Zero());
      add(c, (contact_stiffness_ * c.weight) * (std::max(0.0, depth) * c.out + rubs));
    }
    // A search may end as far out that nothing is pressed: the nearest place is what holds the tool back.
    if (met_ && contact_count_ == 0 && nearest) add(*nearest, force);
    // Springs as stiff as these are off by what the search leaves open: together they hold what the hand feels.
    Vec3<Scalar> sum = Vec3<Scalar>::Zero();
    for (std::size_t i = 0; i < contact_count_; ++i) sum += contacts_[i].force;
    const Scalar share = sum.squaredNorm() > 0 ? sum.dot(force.template cast<Scalar>()) / sum.squaredNorm() : Scalar(0);
    for (std::size_t i = 0; i < contact_count_; ++i) contacts_[i].force *= std::max(Scalar(0), share);
    friction_.end();
    if (!met_) return;
    out.contact.depth = lag_.way.norm() + vertices_.deepest();
    out.wrench.force = force.template cast<Scalar>();
    if (turns()) out.wrench.torque = (-spring.angular(lag_.turn.norm()) * lag_.turn).template cast<Scalar>();
  }

  Tool tool_;
  CoupledOptions options_;
  [[no_unique_address]] FrictionContacts<FrictionLaw> friction_;
  VertexContacts<Scalar> vertices_;
  Posed X_ = Posed::Identity();
  Posed X_before_ = Posed::Identity();  // where the last tick began
  Step drift_before_ = Step::Zero();    // the last tick's motion
  double slide_ = 0;                    // what is predicted of this tick's, in a steady slide [m]
  Posed X_device_ = Posed::Identity();
  Lag lag_;
  bool started_ = false;
  bool met_ = false;       // bone, on this tick's way
  bool pressing_ = false;  // the step in the making presses a place into bone
  bool held_ = false;      // so does the step that ended the search, which is
  double lever_ = 0;       // by which a turn counts as motion [m]: of the coupling or of what is pressed, the longest
  Step last_step_ = Step::Zero();
  double voxel_ = 0;
  double contact_stiffness_ = 0;
  int steps_ = 0;
  std::size_t contact_count_ = 0;
  std::vector<ContactPoint<Scalar>> contacts_;
  std::vector<VecN> ways_;             // −∂φ/∂pose of the places near bone
  std::vector<std::uint8_t> pressed_;  // by the step in the making, of the places near bone
};

template <RealScalar S, DepthSource Depth>
CoupledToolRenderer(ToolDiscretization<SurfaceCounts, S>, Depth, CoupledOptions = {})
    -> CoupledToolRenderer<S, Depth, Frictionless, SixDof>;
template <RealScalar S, DepthSource Depth, Friction FrictionLaw>
CoupledToolRenderer(ToolDiscretization<SurfaceCounts, S>, Depth, CoupledOptions, FrictionLaw)
    -> CoupledToolRenderer<S, Depth, FrictionLaw, SixDof>;

}  // namespace trephine
