// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_proxy.hpp>
#include <trephine/core/misuse.hpp>
#include <trephine/render/line/shaft_tracking.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/render/shaft_force.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

namespace trephine {

/// Where the probe's shaft starts in Eq. 9: on the tip's proxy (a pure rotation spring, as r starts there too) or on
/// the probe, which counts the tip's penetration a second time.
enum class TorqueOrigin { kProxy, kProbe };

struct LineOptions {
  double stiffness = 800;                   ///< k of Eq. 7 [N/m]
  std::optional<double> shaft_stiffness{};  ///< k of F_IntP = k g [N/m]; `stiffness` unless given
  ProxyOptions proxy{};                     ///< tip and shaft: steps, bounds, and the trigger (swept or thesis)
  TorqueOrigin torque_origin = TorqueOrigin::kProxy;
  /// "Moved since t−1" means that an end of the centreline moved farther than this [m]: below the finest encoders.
  double moved = 1e-7;
  /// Follow IntP also while the tool stands still, so that bone carved away under it is noticed. The thesis keeps it.
  bool recheck_at_rest = true;
  /// Look for first contact, and with `ConstrainedTracking` for the touching place, between the neighbours of the
  /// deepest vertex too: a ridge between vertices is placed within a sixteenth of their spacing instead of at one of
  /// them. Costs a lane of samples on top of each look at all vertices.
  bool refine = true;
  /// The drawn ball and shaft rise out of bone, and sink back, by at most this many times the tool's own motion, so
  /// that the drawn tool does not jump by a radius when it touches. Infinite: at once, as in the thesis.
  double drawn_rate = 2;
  /// Keeps the tangent stiffness at T, of tip and shaft together, within a device's means: the shaft's spring at a
  /// lever r has at most angular/r², and tip and shaft at most half of `linear` each (all of it, where the shaft gives
  /// torque alone). No factor follows what touches, so that nothing jumps.
  std::optional<StiffnessBudget> budget{};

  void validate() const {
    const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
    if (!positive(stiffness)) refuse("LineOptions", "stiffness must be > 0 N/m", stiffness);
    if (shaft_stiffness && !positive(*shaft_stiffness))
      refuse("LineOptions", "shaft_stiffness must be > 0 N/m", *shaft_stiffness);
    if (!(moved >= 0) || !std::isfinite(moved)) refuse("LineOptions", "moved must be >= 0 m", moved);
    if (!(drawn_rate > 0)) refuse("LineOptions", "drawn_rate must be > 0", drawn_rate);
    proxy.validate();
    if (budget) budget->validate();
  }
};

/// What the last tick found on the shaft (thesis 3.1.3; Fig. 21, 22), in G.
template <RealScalar Scalar>
struct LineReport {
  bool shaft_contact = false;
  Vec3<Scalar> intersection = Vec3<Scalar>::Zero();  ///< IntP
  Vec3<Scalar> spring = Vec3<Scalar>::Zero();        ///< g = IntP − IntP_probe
  Scalar spring_m = 0;                               ///< |g|
  Scalar lever_m = 0;                                ///< |r|, r = IntP − p_proxy
  Scalar reaction_N = 0;                             ///< |F_IntP|
  Scalar torque_Nm = 0;                              ///< of the shaft, about T's origin
  int active = 0;                                    ///< active vertices of the first contact, if this tick found one
  Vec3<Scalar> tip_force = Vec3<Scalar>::Zero();
};

// What fits no Line ends here, in one sentence.
template <class S, class Step = TranslateRotate, class Track = ConstrainedTracking, class FrictionLaw = Frictionless,
          class Shaft = FullWrench, class GradientChoice = SplineGradient>
class LineApproxRenderer : public detail::UnusableRenderer {
  static_assert(detail::kFits<S>,
                "trephine::LineApproxRenderer: write LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}, "
                "LineOptions{}, TranslateRotate{}, Coulomb{0.2, 0.15}}; the last three may be left out. As a type: "
                "LineApproxRenderer<float, stepping, tracking, friction, shaft force, gradient>");

 public:
  template <class... Arguments>
  explicit LineApproxRenderer(const Arguments&...) noexcept {}
};

/// The Line approximation: thesis 3.1. The tip is a point proxy with a spring (Eq. 6, 7); the shaft's centreline is a
/// row of vertices whose first contact with bone is searched from t−1 toward t (Eq. 1–5) and then tracked; a spring
/// between the touching shaft and the probe's shaft gives reaction and torque (Eq. 8–12). With `TorqueOnly` the torque
/// is `r × F_IntP`. With `FullWrench` the wrench is that of the contacts about T's origin: F_IntP acts at IntP, and the
/// tip's contact bears the part of F_IntP along the tip's own force, as far as that goes. Both torques agree while the
/// tip is free.
///
/// Edges of the loop, as defined here: the first tick has no t−1 and searches nothing; a shaft that starts in bone
/// gives no torque and `kStartedInside` until it has once been free; a search whose last step is free makes no contact;
/// under `Trigger::kThesis` contact needs a vertex of the probe's own pose in bone and ends with it.
///
/// Work a tick: tip and shaft each as SurfaceProxy says (a sample of the shaft is `count` samples, and it takes as many
/// proxy steps as `ConstrainedTracking` has pieces), plus a first contact of at most 2 · (stepping.most_steps + 1) ·
/// count samples. Tip and shaft, each alone, take none where nothing is in contact and the field knows that the way is
/// clear (beyond the grid, or by `EmptySpaceSkipping`).
template <RealScalar S, Stepping Step, Tracking Track, Friction FrictionLaw, ShaftForce Shaft,
          GradientPolicy GradientChoice>
class LineApproxRenderer<S, Step, Track, FrictionLaw, Shaft, GradientChoice> {
 public:
  using Scalar = S;
  using Gradient = GradientChoice;
  using Tool = ToolDiscretization<LineCounts, Scalar>;

  /// Throws std::invalid_argument for options outside their range.
  explicit LineApproxRenderer(Tool tool, const LineOptions& options = {}, const Step& stepping = Step{},
                              const FrictionLaw& friction = FrictionLaw{})
      : tool_(std::move(tool)),
        options_(options),
        stepping_(stepping),
        tip_(options.proxy, friction),
        shaft_(shaft_options(options.proxy, tool_), friction),
        scratch_(2 * static_cast<std::size_t>(std::max(tool_.padded(), kLane))) {
    options.validate();
    stepping.validate();
    for (const double k : {options.stiffness, options.shaft_stiffness.value_or(options.stiffness)})
      if (!(k <= static_cast<double>(std::numeric_limits<Scalar>::max())))
        refuse("LineApproxRenderer", "stiffness must be finite in the renderer's precision", k);
  }

  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    const Pose<Scalar> before = X_GT_;
    X_GT_ = X_GT;
    report_ = {};
    contact_count_ = 0;
    Rendered<Scalar> out;
    const Vec3<Scalar> p = X_GT.translation();

    out.status = tip_.follow(field, p);
    const Vec3<Scalar> e = tip_.in_contact() ? Vec3<Scalar>(tip_.position() - p) : Vec3<Scalar>::Zero();  // Eq. 6
    report_.tip_force = static_cast<Scalar>(stiffness()) * e;                                             // Eq. 7
    out.wrench.force = report_.tip_force;
    if (tip_.in_contact()) {
      contacts_[contact_count_++] = {tip_.position(), tip_.normal(), report_.tip_force};
      out.contact.tip = true;
      out.contact.depth = static_cast<double>(e.norm());
    }
    if (tool_.count() > 0) add_shaft(field, out);
    out.contact.count = static_cast<int>(contact_count_);
    move_drawn(before, !drawn_ || needs_ramp(out.status));
    return out;
  }

  void reset() noexcept {
    tip_.reset();
    shaft_.reset();
    has_previous_ = false;
    embedded_ = false;
    drawn_ = false;
    contact_count_ = 0;
    report_ = {};
  }

  /// A scene whose answers are forces alone asks for this before its first tick: a shaft that gives none has no
  /// vertices then and is not looked at, and the proxy does not lean on it.
  void disable_torque() requires(!Shaft::kForce) { tool_ = tool_.without_shaft(); }

  [[nodiscard]] const LineReport<Scalar>& report() const noexcept { return report_; }
  [[nodiscard]] const LineOptions& options() const noexcept { return options_; }
  /// Of the tip, as felt [N/m].
  [[nodiscard]] double stiffness() const noexcept {
    return options_.budget ? std::min(options_.stiffness, linear_share()) : options_.stiffness;
  }
  /// Of the shaft's spring at `lever` [m] from T, as felt [N/m]; the spring's own length counts as lever.
  [[nodiscard]] double shaft_stiffness(double lever) const noexcept {
    const double k = options_.shaft_stiffness.value_or(options_.stiffness);
    if (!options_.budget) return k;
    const double about_tip = options_.budget->angular / std::max(lever * lever, 1e-12);
    return std::min({k, about_tip, Shaft::kForce ? linear_share() : k});
  }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  [[nodiscard]] const SurfaceProxy<Scalar, FrictionLaw>& tip_proxy() const noexcept { return tip_; }

  /// The tip on its proxy, the shaft through IntP (thesis: the proxy shaft points along r).
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept {
    const Vec3<Scalar> tip = tip_position();
    return turned_to(tip, report_.shaft_contact ? Vec3<Scalar>(report_.intersection - tip) : X_GT_.linear().col(2));
  }
  /// Carving follows the tip proxy's centre, not the drawn tool's.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept {
    Pose<Scalar> X = X_GT_;
    X.translation() = tip_position();
    return X;
  }
  /// The tool as drawn (3.1.5, Eq. 13, 14): ball and shaft stand on the surface by their radii instead of piercing it,
  /// led there by `drawn_rate`.
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept {
    const Vec3<Scalar> tip = tip_position();
    const Vec3<Scalar> along =
        report_.shaft_contact ? Vec3<Scalar>(report_.intersection - tip) : Vec3<Scalar>(lever_ * X_GT_.linear().col(2));
    return turned_to(tip + tip_lift_, along + lean_);
  }

 private:
  // The shaft's probe is its far end, which a quick turn of the wrist moves farther than a hand moves a tip.
  [[nodiscard]] static ProxyOptions shaft_options(ProxyOptions options, const Tool& tool) {
    constexpr double kQuickestTurn = 0.2;  // rad a tick: 200 rad/s at 1 kHz
    options.jump = std::max(options.jump, kQuickestTurn * tool.burr().shaft_length);
    return options;
  }

  [[nodiscard]] Vec3<Scalar> tip_position() const noexcept {
    return tip_.in_contact() ? tip_.position() : Vec3<Scalar>(X_GT_.translation());
  }

  [[nodiscard]] Pose<Scalar> turned_to(const Vec3<Scalar>& tip, const Vec3<Scalar>& direction) const noexcept {
    Pose<Scalar> X = X_GT_;
    X.translation() = tip;
    if (direction.norm() > Scalar(0))
      X.linear() = rotation_between<Scalar>(X_GT_.linear().col(2), direction.normalized()) * X_GT_.linear();
    return X;
  }

  // Leads the drawn ball from its centre on the proxy toward its radius above the bone, and the shaft's axis likewise.
  void move_drawn(const Pose<Scalar>& before, bool at_once) noexcept {
    const auto lead = [](Vec3<Scalar>& v, const Vec3<Scalar>& to, Scalar most) {
      const Vec3<Scalar> way = to - v;
      const Scalar length = way.norm();
      v = length > most ? Vec3<Scalar>(v + (most / length) * way) : to;
    };
    const Scalar factor = at_once ? std::numeric_limits<Scalar>::infinity() : static_cast<Scalar>(options_.drawn_rate);
    const Scalar moved = (X_GT_.translation() - before.translation()).norm();
    const Scalar turned = (X_GT_.linear().col(2) - before.linear().col(2)).norm();
    Vec3<Scalar> up = Vec3<Scalar>::Zero(), lean = up;
    if (tip_.in_contact()) up = static_cast<Scalar>(shape().tip_radius) * tip_.normal();
    lead(tip_lift_, up, factor * moved);
    if (report_.shaft_contact) {
      lever_ = report_.lever_m;
      lean = static_cast<Scalar>(shape().shaft_radius) * shaft_normal_ - tip_lift_;
    }
    lead(lean_, lean, factor * (moved + lever_ * turned));
    drawn_ = true;
  }

  template <ContactField Field>
  void add_shaft(const Field& field, Rendered<Scalar>& out) noexcept {
    const Centreline<Scalar> probe{X_GT_.translation(), X_GT_.linear().col(2)};
    ShaftScene<Field> scene{field,     tool_,           {tip_position(), probe.direction},
                            previous_, scratch_.data(), options_.refine};
    const ShaftContact<Scalar> c = touch(scene, probe, out.status);
    out.status = worse(out.status, c.status);
    if (!c.touching) return;

    const Vec3<Scalar> r = c.point - scene.offset.tip;  // Eq. 8
    const Vec3<Scalar>& p = options_.torque_origin == TorqueOrigin::kProxy ? scene.offset.tip : probe.tip;
    const Vec3<Scalar> on_probe = p + r.norm() * probe.direction;  // Eq. 9
    const Vec3<Scalar> g = c.point - on_probe;                     // Eq. 10
    const Scalar k = static_cast<Scalar>(shaft_stiffness(static_cast<double>(r.norm() + g.norm())));
    const Vec3<Scalar> f = k * g;      // Eq. 11
    Vec3<Scalar> torque = r.cross(f);  // Eq. 12
    if constexpr (Shaft::kForce) {
      torque = (c.point - probe.tip).cross(f);
      const Vec3<Scalar> borne = borne_by_tip(f);
      if (tip_.in_contact()) contacts_[0].force -= borne;
      out.wrench.force += f - borne;
    }
    out.wrench.torque += torque;
    out.contact.shaft = true;
    out.contact.depth = std::max(out.contact.depth, static_cast<double>(g.norm()));
    contacts_[contact_count_++] = {c.point, c.normal, f};
    shaft_normal_ = c.normal;
    report_.shaft_contact = true;
    report_.intersection = c.point;
    report_.spring = g;
    report_.spring_m = g.norm();
    report_.lever_m = r.norm();
    report_.reaction_N = f.norm();
    report_.torque_Nm = torque.norm();
  }

  // The part of the shaft's force that the bone under the tip bears. A probe that moves along the tip's force leaves
  // the tip's proxy, and with it the shaft's spring, where they are: felt as well, that part would make energy. At most
  // the tip's own force, so that nothing jumps when the tip touches.
  [[nodiscard]] Vec3<Scalar> borne_by_tip(const Vec3<Scalar>& f) const noexcept {
    const Scalar most = report_.tip_force.norm();
    if (!(most > Scalar(0))) return Vec3<Scalar>::Zero();
    const Vec3<Scalar> along = report_.tip_force / most;
    return std::clamp(f.dot(along), -most, most) * along;
  }

  // Tip and shaft push side by side where the shaft gives force too.
  [[nodiscard]] double linear_share() const noexcept { return options_.budget->linear / (Shaft::kForce ? 2 : 1); }

  // Step (c) of the thesis' tick: keep, search or track.
  template <ContactField Field>
  ShaftContact<Scalar> touch(ShaftScene<Field>& s, const Centreline<Scalar>& probe, Status tip) noexcept {
    if (!has_previous_ || embedded_ || needs_ramp(tip)) return start(s);
    const bool thesis = options_.proxy.trigger == Trigger::kThesis;
    if (thesis && !in_bone(s, probe)) {
      shaft_.reset();
      stand_at(s.offset);
      return {};
    }
    const Scalar far_move = (s.offset.at(s.length()) - previous_.at(s.length())).norm();
    const Scalar moved = std::max(far_move, Scalar((s.offset.tip - previous_.tip).norm()));
    if (!(moved > static_cast<Scalar>(options_.moved)) && !(options_.recheck_at_rest && shaft_.in_contact())) {
      if (!shaft_.in_contact()) return {};
      return {.touching = true, .point = intersection_, .normal = shaft_normal_};
    }
    ShaftContact<Scalar> c;
    if (shaft_.in_contact()) {
      c = Track::track(s, shaft_);
    } else {
      const auto hit = find_first_contact(s.field, s.tool, stepping_, previous_, s.offset, s.scratch, s.refined);
      report_.active = hit.active;
      if (hit.found) {
        s.previous = hit.line;
        c = Track::begin(s, hit.point, shaft_);
      }
      if (hit.bounded) c.status = worse(c.status, Status::kWorkBound);
    }
    embedded_ = !c.touching && needs_ramp(c.status);
    intersection_ = c.point;
    stand_at(s.offset);
    return c;
  }

  // Where the next tick's moves are measured and searched from. A tool that has not moved leaves it alone, so that
  // moves too short to count add up.
  void stand_at(const Centreline<Scalar>& line) noexcept {
    previous_ = line;
    has_previous_ = true;
  }

  // Without a free line at t−1 there is nothing to search from: wait until the shaft is free.
  template <ContactField Field>
  ShaftContact<Scalar> start(const ShaftScene<Field>& s) noexcept {
    shaft_.reset();
    stand_at(s.offset);
    embedded_ = in_bone(s, s.offset);
    return {.touching = false, .status = embedded_ ? Status::kStartedInside : Status::kOk};
  }

  template <ContactField Field>
  [[nodiscard]] static bool in_bone(const ShaftScene<Field>& s, const Centreline<Scalar>& line) noexcept {
    if (is_way_clear(s.field, line, line, s.length())) return false;
    line_values(s.field, s.tool, line, s.scratch);
    return s.scratch[index_of_largest(s.scratch, s.tool.count())] >= Scalar(0);
  }

  Tool tool_;
  LineOptions options_;
  Step stepping_;
  SurfaceProxy<Scalar, FrictionLaw> tip_;
  SurfaceProxy<Scalar, FrictionLaw> shaft_;
  std::vector<Scalar> scratch_;
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
  Centreline<Scalar> previous_{};
  bool has_previous_ = false;
  bool embedded_ = false;
  bool drawn_ = false;
  Vec3<Scalar> tip_lift_ = Vec3<Scalar>::Zero();  // of the drawn ball over the tip's proxy
  Vec3<Scalar> lean_ = Vec3<Scalar>::Zero();      // of the drawn shaft at its contact, beside what the ball is lifted
  Scalar lever_ = Scalar(1);                      // of the last contact of the shaft
  Vec3<Scalar> intersection_ = Vec3<Scalar>::Zero();
  Vec3<Scalar> shaft_normal_ = Vec3<Scalar>::Zero();
  LineReport<Scalar> report_{};
  std::array<ContactPoint<Scalar>, 2> contacts_{};
  std::size_t contact_count_ = 0;
};

template <class S>
LineApproxRenderer(ToolDiscretization<LineCounts, S>) -> LineApproxRenderer<S>;
template <class S>
LineApproxRenderer(ToolDiscretization<LineCounts, S>, LineOptions) -> LineApproxRenderer<S>;
template <class S, Stepping Step>
LineApproxRenderer(ToolDiscretization<LineCounts, S>, LineOptions, Step) -> LineApproxRenderer<S, Step>;
template <class S, Stepping Step, Friction F>
LineApproxRenderer(ToolDiscretization<LineCounts, S>, LineOptions, Step, F)
    -> LineApproxRenderer<S, Step, ConstrainedTracking, F>;
template <class... Arguments>
LineApproxRenderer(const Arguments&...) -> LineApproxRenderer<detail::Misused<Arguments...>>;

}  // namespace trephine
