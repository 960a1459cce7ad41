// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_proxy.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/render/line/line_options.hpp>
#include <trephine/render/line/shaft_tracking.hpp>
#include <trephine/render/renderer.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Line approximation (thesis 3.1): a point proxy for the tip, and the shaft's centreline as a row of vertices.
///
/// A spring joins the tip to its proxy (Eq. 6, 7). The shaft's first contact is searched from t−1 toward t (Eq. 1–5)
/// and then tracked. A spring between the contact point of the shaft and the probe's shaft gives a reaction and a
/// torque (Eq. 8–12). The wrench is that of the contacts about T's origin: F_IntP acts at IntP, and the tip's contact
/// carries the part of F_IntP along the tip's own force, up to that force.
///
/// Special cases: the first tick has no t−1 and searches nothing. A shaft that starts in bone gives no torque and
/// `kStartedInside` until it is free. A search whose last step is free makes no contact.
///
/// Work per tick: tip and shaft each as in SurfaceProxy, where a sample of the shaft is `count` samples, repeated for
/// each piece of `track_shaft`. A first contact adds at most 2 · (stepping.max_steps + 1) · count samples. Tip
/// and shaft each take no samples while their path is beyond the grid.
///
/// Write `LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}, LineOptions{}, TranslateRotate{}, Coulomb{0.2,
/// 0.15}}`; the last three may be left out.
template <RealScalar S, Stepping Step = TranslateRotate, Friction FrictionLaw = Frictionless, class Shape = Burr>
class LineApproxRenderer {
  // Largest rotation per tick without a jump [rad]: 200 rad/s at 1 kHz, beyond any wrist. It extends `jump` for the far
  // end of the shaft, which a quick rotation moves farther than a hand moves a tip.
  static constexpr double kMaxRotation = 0.2;
  // Smallest squared lever for the angular budget [m²]: it avoids a division by zero at T's origin.
  static constexpr double kMinLever2 = 1e-12;

 public:
  using Scalar = S;
  using Gradient = SplineGradient;
  using Tool = ToolDiscretization<LineCounts, Scalar, Shape>;

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

  /// Computes the wrench on the tool at pose X_GT, about T's origin in G axes.
  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    const Pose<Scalar> previous_X_GT = X_GT_;
    X_GT_ = X_GT;
    report_ = {};
    contact_count_ = 0;
    Rendered<Scalar> result;
    const Vec3<Scalar> p = X_GT.translation();

    result.status = tip_.follow(field, p);
    const Vec3<Scalar> e = tip_.in_contact() ? Vec3<Scalar>(tip_.position() - p) : Vec3<Scalar>::Zero();  // Eq. 6
    report_.tip_force = static_cast<Scalar>(stiffness()) * e;                                             // Eq. 7
    result.wrench.force = report_.tip_force;
    if (tip_.in_contact()) {
      contacts_[contact_count_++] = {tip_.position(), tip_.normal(), report_.tip_force};
      result.contact.tip = true;
      result.contact.depth = static_cast<double>(e.norm());
    }
    if (tool_.count() > 0) add_shaft(field, result);
    result.contact.count = static_cast<int>(contact_count_);
    move_drawn(previous_X_GT, !has_drawn_ || needs_ramp(result.status));
    return result;
  }

  /// Clears all contact state.
  void reset() noexcept {
    tip_.reset();
    shaft_.reset();
    has_previous_ = false;
    embedded_ = false;
    has_drawn_ = false;
    contact_count_ = 0;
    report_ = {};
  }

  [[nodiscard]] const LineReport<Scalar>& report() const noexcept { return report_; }
  [[nodiscard]] const LineOptions& options() const noexcept { return options_; }
  /// Stiffness of the tip's spring, within the budget [N/m].
  [[nodiscard]] double stiffness() const noexcept {
    return options_.budget ? std::min(options_.stiffness, linear_limit()) : options_.stiffness;
  }
  /// Stiffness of the shaft's spring at `lever` [m] from T, within the budget [N/m]. The lever includes the spring's
  /// own length.
  [[nodiscard]] double shaft_stiffness(double lever) const noexcept {
    const double k = options_.shaft_stiffness.value_or(options_.stiffness);
    if (!options_.budget) return k;
    const double angular_limit = options_.budget->angular / std::max(lever * lever, kMinLever2);
    return std::min({k, angular_limit, linear_limit()});
  }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  /// The burr, or one of the tool's size.
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  /// The part that cuts, of a tool that is no burr.
  [[nodiscard]] const auto& cutting_head() const noexcept
    requires requires(const Tool& t) { t.cutting_head(); }
  {
    return tool_.cutting_head();
  }
  /// Contacts of the last tick, in G: tip and shaft.
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  [[nodiscard]] const SurfaceProxy<Scalar, FrictionLaw>& tip_proxy() const noexcept { return tip_; }

  /// X_GP: the tip at its proxy, the shaft through IntP (thesis: the proxy's shaft points along r).
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept {
    const Vec3<Scalar> tip = tip_position();
    return pose_along<Scalar>(X_GT_, tip,
                              report_.shaft_contact ? Vec3<Scalar>(report_.intersection - tip) : z_axis(X_GT_));
  }
  /// Pose at which the burr cuts: the tip's proxy with the device's rotation, not the drawn tool.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept {
    Pose<Scalar> X = X_GT_;
    X.translation() = tip_position();
    return X;
  }
  /// Pose of the drawn tool (3.1.5, Eq. 13, 14): ball and shaft lie on the surface by their radii instead of
  /// penetrating it. `drawn_rate` limits its motion.
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept {
    const Vec3<Scalar> tip = tip_position();
    const Vec3<Scalar> along =
        report_.shaft_contact ? Vec3<Scalar>(report_.intersection - tip) : Vec3<Scalar>(lever_ * z_axis(X_GT_));
    return pose_along<Scalar>(X_GT_, tip + tip_offset_, along + shaft_offset_);
  }

 private:
  // Proxy options of the shaft, whose probe is its far end.
  [[nodiscard]] static ProxyOptions shaft_options(ProxyOptions options, const Tool& tool) {
    options.jump = std::max(options.jump, kMaxRotation * tool.burr().shaft_length);
    return options;
  }

  [[nodiscard]] Vec3<Scalar> tip_position() const noexcept {
    return tip_.in_contact() ? tip_.position() : Vec3<Scalar>(X_GT_.translation());
  }

  // Moves the drawn ball from its centre on the proxy toward its radius above bone, and the drawn shaft's axis
  // likewise. `at_once` removes the limit on their motion.
  void move_drawn(const Pose<Scalar>& previous_X_GT, bool at_once) noexcept {
    const auto approach = [](Vec3<Scalar>& v, const Vec3<Scalar>& target, Scalar max) {
      const Vec3<Scalar> displacement = target - v;
      const Scalar length = displacement.norm();
      v = length > max ? Vec3<Scalar>(v + (max / length) * displacement) : target;
    };
    const Scalar rate = at_once ? std::numeric_limits<Scalar>::infinity() : static_cast<Scalar>(options_.drawn_rate);
    const Scalar translation = (X_GT_.translation() - previous_X_GT.translation()).norm();
    const Scalar rotation = (z_axis(X_GT_) - z_axis(previous_X_GT)).norm();
    Vec3<Scalar> tip_target = Vec3<Scalar>::Zero(), shaft_target = tip_target;
    if (tip_.in_contact()) tip_target = static_cast<Scalar>(shape().tip_radius) * tip_.normal();
    approach(tip_offset_, tip_target, rate * translation);
    if (report_.shaft_contact) {
      lever_ = report_.lever_m;
      shaft_target = static_cast<Scalar>(shape().shaft_radius) * shaft_normal_ - tip_offset_;
    }
    approach(shaft_offset_, shaft_target, rate * (translation + lever_ * rotation));
    has_drawn_ = true;
  }

  // Adds the shaft's contact to the output.
  template <ContactField Field>
  void add_shaft(const Field& field, Rendered<Scalar>& result) noexcept {
    const Centreline<Scalar> probe{X_GT_.translation(), z_axis(X_GT_)};
    ShaftScene<Field> scene{field, tool_, {tip_position(), probe.direction}, previous_, scratch_.data()};
    const ShaftContact<Scalar> c = update_shaft(scene, result.status);
    result.status = worse(result.status, c.status);
    if (!c.touching) return;

    const Vec3<Scalar> r = c.point - scene.offset.tip;                            // Eq. 8
    const Vec3<Scalar> on_probe = scene.offset.tip + r.norm() * probe.direction;  // Eq. 9
    const Vec3<Scalar> g = c.point - on_probe;                                    // Eq. 10
    const Scalar k = static_cast<Scalar>(shaft_stiffness(static_cast<double>(r.norm() + g.norm())));
    const Vec3<Scalar> f = k * g;                                // Eq. 11
    const Vec3<Scalar> torque = (c.point - probe.tip).cross(f);  // Eq. 12, about T's origin
    const Vec3<Scalar> on_tip = part_on_tip(f);
    if (tip_.in_contact()) contacts_[0].force -= on_tip;
    result.wrench.force += f - on_tip;
    result.wrench.torque += torque;
    result.contact.shaft = true;
    result.contact.depth = std::max(result.contact.depth, static_cast<double>(g.norm()));
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

  // Part of the shaft's force f that the bone under the tip carries. If the probe moves along the tip's force, the
  // tip's proxy and the shaft's spring do not move: with this part in the wrench, the motion would generate energy. The
  // part is limited to the tip's own force, so that the wrench is continuous when the tip makes contact.
  [[nodiscard]] Vec3<Scalar> part_on_tip(const Vec3<Scalar>& f) const noexcept {
    const Scalar max = report_.tip_force.norm();
    if (!(max > Scalar(0))) return Vec3<Scalar>::Zero();
    const Vec3<Scalar> along = report_.tip_force / max;
    return std::clamp(f.dot(along), -max, max) * along;
  }

  // Linear stiffness limit of tip and of shaft [N/m]: half the budget each.
  [[nodiscard]] double linear_limit() const noexcept { return options_.budget->linear / 2; }

  // Step (c) of the thesis' tick: keeps, searches or tracks the shaft's contact.
  template <ContactField Field>
  ShaftContact<Scalar> update_shaft(ShaftScene<Field>& s, Status tip) noexcept {
    if (!has_previous_ || embedded_ || needs_ramp(tip)) return start_shaft(s);
    const Scalar far_motion = (s.offset.at(s.length()) - previous_.at(s.length())).norm();
    const Scalar motion = std::max(far_motion, Scalar((s.offset.tip - previous_.tip).norm()));
    ShaftContact<Scalar> c;
    if (shaft_.in_contact()) {
      c = track_shaft(s, shaft_);
    } else {
      if (!(motion > static_cast<Scalar>(options_.rest_threshold))) return {};
      const auto hit = find_first_contact(s.field, s.tool, stepping_, previous_, s.offset, s.scratch);
      report_.active = hit.active;
      if (hit.found) {
        s.previous = hit.line;
        c = start_shaft_contact(s, shaft_);
      }
      if (hit.bounded) c.status = worse(c.status, Status::kWorkBound);
    }
    embedded_ = !c.touching && needs_ramp(c.status);
    set_previous(s.offset);
    return c;
  }

  // Sets the line from which the next tick measures motion and searches. A resting tool keeps it, so that motions below
  // the threshold accumulate.
  void set_previous(const Centreline<Scalar>& line) noexcept {
    previous_ = line;
    has_previous_ = true;
  }

  // Starts without a free line at t−1. A shaft in bone has nothing to search from: it stays embedded until it is free.
  template <ContactField Field>
  ShaftContact<Scalar> start_shaft(const ShaftScene<Field>& s) noexcept {
    shaft_.reset();
    set_previous(s.offset);
    embedded_ = is_in_bone(s, s.offset);
    return {.touching = false, .status = embedded_ ? Status::kStartedInside : Status::kOk};
  }

  // True if a vertex of the line is in bone.
  template <ContactField Field>
  [[nodiscard]] static bool is_in_bone(const ShaftScene<Field>& s, const Centreline<Scalar>& line) noexcept {
    if (is_path_beyond(s.field, line, line, s.length())) return false;
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
  Centreline<Scalar> previous_{};  // offset centreline at t−1
  bool has_previous_ = false;
  bool embedded_ = false;                           // the shaft is in bone without a contact to track, until it is free
  bool has_drawn_ = false;                          // the drawn offsets are valid
  Vec3<Scalar> tip_offset_ = Vec3<Scalar>::Zero();  // of the drawn ball from the tip's proxy [m]
  Vec3<Scalar> shaft_offset_ = Vec3<Scalar>::Zero();  // of the drawn shaft at its contact, in addition [m]
  Scalar lever_ = Scalar(1);                          // of the shaft's last contact [m]
  Vec3<Scalar> shaft_normal_ = Vec3<Scalar>::Zero();
  LineReport<Scalar> report_{};
  std::array<ContactPoint<Scalar>, 2> contacts_{};
  std::size_t contact_count_ = 0;
};

template <class S, class Shape, Stepping Step = TranslateRotate, Friction F = Frictionless>
LineApproxRenderer(ToolDiscretization<LineCounts, S, Shape>, LineOptions = {}, Step = {}, F = {})
    -> LineApproxRenderer<S, Step, F, Shape>;

}  // namespace trephine
