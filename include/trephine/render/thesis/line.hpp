// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_proxy.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/render/line/line_options.hpp>
#include <trephine/render/renderer.hpp>
#include <trephine/render/thesis/line_equations.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

/// The Line approximation as the thesis writes it (section 3.1): to read beside the thesis, and to measure
/// `LineApproxRenderer` against. Where the thesis leaves a question open, this is its own reading.
namespace trephine::inline TREPHINE_ALIGNED {

struct ThesisLineOptions {
  double stiffness = 800;     ///< k of Eq. 7 and 11 [N/m]
  double friction = 0;        ///< Coulomb's coefficient, of tip and IntP
  bool ray_casting = false;   ///< searches by Eq. 5, else by Eq. 3 and 4
  int translation_steps = 8;  ///< of Eq. 3
  int rotation_steps = 8;     ///< of Eq. 4
  int raycast_steps = 16;     ///< of Eq. 5
  ProxyOptions proxy{};       ///< of the proxy's steps on the surface (3.1.4)

  /// Throws std::invalid_argument for a number outside its range.
  void validate() const {
    if (!(stiffness > 0) || !is_finite(stiffness)) refuse("ThesisLineOptions", "stiffness must be > 0 N/m", stiffness);
    for (const int steps : {translation_steps, rotation_steps, raycast_steps})
      if (!(steps >= 1 && steps <= 100000)) refuse("ThesisLineOptions", "step counts must be 1 to 100000", steps);
    proxy.validate();
  }
};

/// The Line approximation as the thesis writes it. The tip has a force by a proxy; the shaft has a torque without its
/// force. A wall that is crossed within a tick is not noticed, because both need a collision at t.
template <RealScalar S = float>
class ThesisLine {
  static constexpr auto kMoved = S(1e-7);      // motion of the centreline's ends below which the tool stands still [m]
  static constexpr double kMaxRotation = 0.2;  // per tick without a jump [rad], of the proxy IntP

 public:
  using Scalar = S;
  using Gradient = CentralGradient;  // section 2.1.2: the differences that the thesis stores at voxels, interpolated
  using Tool = ToolDiscretization<LineCounts, Scalar>;

  /// Throws std::invalid_argument for options outside their range.
  explicit ThesisLine(Tool tool, const ThesisLineOptions& options = {})
      : tool_(std::move(tool)),
        options_(options),
        tip_(options.proxy, Coulomb(options.friction, options.friction)),
        intp_(intp_options(), Coulomb(options.friction, options.friction)),
        before_(static_cast<std::size_t>(std::max(tool_.padded(), kLane))),
        now_(before_.size()) {
    options.validate();
  }

  /// One tick, steps (a) to (c) of section 3.1: the wrench at pose X_GT, about T's origin in G axes.
  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    const Centreline<Scalar> probe{X_GT.translation(), z_axis(X_GT)};
    const bool jumped =
        has_previous_ && !((probe.tip - X_GT_.translation()).norm() <= static_cast<Scalar>(options_.proxy.jump));
    if (jumped) reset();
    X_GT_ = X_GT;
    report_ = {};
    contact_count_ = 0;
    Rendered<Scalar> result;
    result.status = move_proxy(field, probe.tip, tip_);  // (a)
    if (jumped) result.status = worse(result.status, Status::kJump);
    if (tip_.in_contact()) {
      const Vec3<Scalar> e = eq_6_spring(probe.tip);
      report_.tip_force = result.wrench.force = eq_7_tip_force(e);
      contacts_[contact_count_++] = {tip_.position(), tip_.normal(), report_.tip_force};
      result.contact.tip = true;
      result.contact.depth = static_cast<double>(e.norm());
    }
    if (tool_.count() > 0) result.status = worse(result.status, move_shaft(field, probe, result.status));  // (b), (c)
    if (report_.shaft_contact) result.wrench.torque = shaft_torque(probe, result.contact);
    result.contact.count = static_cast<int>(contact_count_);
    return result;
  }

  /// Clears all contact state.
  void reset() noexcept {
    tip_.reset();
    intp_.reset();
    has_previous_ = embedded_ = false;
    contact_count_ = 0;
    report_ = {};
  }

  [[nodiscard]] const LineReport<Scalar>& report() const noexcept { return report_; }
  [[nodiscard]] const ThesisLineOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  /// Contacts of the last tick, in G: the tip's, then IntP with the shaft's reaction, which is not in the wrench.
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// X_GP: the tip at its proxy, the shaft along r.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept {
    return pose_along<Scalar>(X_GT_, tip_position(), report_.shaft_contact ? eq_8_lever() : z_axis(X_GT_));
  }
  /// Pose at which the burr cuts: the tip's proxy with the device's rotation.
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept {
    return pose_along<Scalar>(X_GT_, tip_position(), z_axis(X_GT_));
  }
  /// Pose of the drawn tool (3.1.5).
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept {
    const Vec3<Scalar> tip = eq_13_drawn_tip();
    return pose_along<Scalar>(X_GT_, tip,
                              report_.shaft_contact ? Vec3<Scalar>(eq_14_drawn_contact() - tip) : z_axis(X_GT_));
  }

  /// Eq. 6: e = p_proxy − p_probe.
  [[nodiscard]] Vec3<Scalar> eq_6_spring(const Vec3<Scalar>& p_probe) const noexcept {
    return tip_.position() - p_probe;
  }
  /// Eq. 7: F = k e.
  [[nodiscard]] Vec3<Scalar> eq_7_tip_force(const Vec3<Scalar>& e) const noexcept { return k() * e; }
  /// Eq. 8: r = IntP − p_proxy.
  [[nodiscard]] Vec3<Scalar> eq_8_lever() const noexcept { return report_.intersection - tip_position(); }
  /// Eq. 9: the place of IntP on the probe's shaft, from the proxy, where r starts too.
  [[nodiscard]] Vec3<Scalar> eq_9_on_probe(const Vec3<Scalar>& r, const Vec3<Scalar>& direction) const noexcept {
    return tip_position() + r.norm() * direction;
  }
  /// Eq. 10: g = IntP − IntP_probe.
  [[nodiscard]] Vec3<Scalar> eq_10_spring(const Vec3<Scalar>& on_probe) const noexcept {
    return report_.intersection - on_probe;
  }
  /// Eq. 11: F_IntP = k g.
  [[nodiscard]] Vec3<Scalar> eq_11_reaction(const Vec3<Scalar>& g) const noexcept { return k() * g; }
  /// Eq. 12: T = r × F_IntP.
  [[nodiscard]] static Vec3<Scalar> eq_12_torque(const Vec3<Scalar>& r, const Vec3<Scalar>& f) noexcept {
    return r.cross(f);
  }
  /// Eq. 13: the drawn ball's centre, p_proxy + û R_sphere.
  [[nodiscard]] Vec3<Scalar> eq_13_drawn_tip() const noexcept {
    if (!tip_.in_contact()) return tip_position();
    return tip_position() + static_cast<Scalar>(shape().tip_radius) * tip_.normal();
  }
  /// Eq. 14: the point through which the drawn shaft's axis goes, IntP + û_IntP R_shaft.
  [[nodiscard]] Vec3<Scalar> eq_14_drawn_contact() const noexcept {
    return report_.intersection + static_cast<Scalar>(shape().shaft_radius) * intp_.normal();
  }

 private:
  [[nodiscard]] Scalar k() const noexcept { return static_cast<Scalar>(options_.stiffness); }
  [[nodiscard]] Vec3<Scalar> tip_position() const noexcept {
    return tip_.in_contact() ? tip_.position() : Vec3<Scalar>(X_GT_.translation());
  }
  // IntP's probe may be far up the shaft, which a rotation moves farther than a hand moves a tip.
  [[nodiscard]] ProxyOptions intp_options() const {
    ProxyOptions o = options_.proxy;
    o.jump = std::max(o.jump, kMaxRotation * shape().shaft_length);
    return o;
  }

  // Sections 2.1.3, 3.1.4: without a collision the proxy is at the probe; else it moves on the surface toward it.
  template <ContactField Field>
  static Status move_proxy(const Field& field, const Vec3<Scalar>& probe,
                           SurfaceProxy<Scalar, Coulomb>& proxy) noexcept {
    if (field.value(probe) >= Scalar(0)) return proxy.follow(field, probe);
    proxy.place_free(probe);
    return Status::kOk;
  }

  // Steps (b) and (c): did the tool move, does the shaft collide at t, did it at t−1? Sets the report's contact.
  template <ContactField Field>
  Status move_shaft(const Field& field, const Centreline<Scalar>& probe, Status tip) noexcept {
    const Centreline<Scalar> offset{tip_position(), probe.direction};  // offset_t
    if (!has_previous_ || embedded_ || needs_ramp(tip)) {              // no line at t−1 outside bone
      intp_.reset();
      embedded_ = collides(field, offset);
      set_previous(offset);
      return embedded_ ? Status::kStartedInside : Status::kOk;
    }
    if (!collides(field, probe)) {
      intp_.reset();
      set_previous(offset);
      return Status::kOk;
    }
    const Scalar length = tool_.heights()[static_cast<std::size_t>(tool_.count() - 1)];
    const Scalar motion =
        std::max((offset.at(length) - previous_.at(length)).norm(), (offset.tip - previous_.tip).norm());
    Status status = Status::kOk;
    if (motion > kMoved) {
      if (intp_.in_contact())
        status = track(field, offset);
      else
        search_first_contact(field, offset);
      embedded_ = !intp_.in_contact() && needs_ramp(status);
      set_previous(offset);
    }
    report_.shaft_contact = intp_.in_contact();
    report_.intersection = intp_.position();
    return status;
  }

  // First contact: from t−1 toward offset_t, to the first step at which vertices collide, the active ones. The smallest
  // fraction is the most active vertex.
  template <ContactField Field>
  void search_first_contact(const Field& field, const Centreline<Scalar>& offset) noexcept {
    Centreline<Scalar> from = previous_;
    line_values(field, tool_, from, before_.data());
    for (int n = 1; n <= search_steps(); ++n, std::swap(before_, now_)) {
      const Centreline<Scalar> to = search_line(offset, n);
      line_values(field, tool_, to, now_.data());
      Scalar smallest = Scalar(2), height = Scalar(0);
      for (std::size_t i = 0; i < static_cast<std::size_t>(tool_.count()); ++i) {
        if (!(now_[i] >= Scalar(0))) continue;
        ++report_.active;
        const Scalar f = eq_1_fraction(before_[i], now_[i]);
        if (!(f < smallest)) continue;
        smallest = f;
        height = tool_.heights()[i];
      }
      if (report_.active > 0)
        return intp_.attach_at(field, eq_2_intersection(smallest, from.at(height), to.at(height)));
      from = to;
    }
  }
  [[nodiscard]] int search_steps() const noexcept {
    return options_.ray_casting ? options_.raycast_steps : options_.translation_steps + options_.rotation_steps;
  }
  // The line after n steps of the search: translated, then rotated; or cast.
  [[nodiscard]] Centreline<Scalar> search_line(const Centreline<Scalar>& offset, int n) const noexcept {
    const auto fraction = [](int steps, int of) { return static_cast<Scalar>(steps) / static_cast<Scalar>(of); };
    if (n == search_steps()) return offset;
    if (options_.ray_casting) return eq_5_ray_cast(previous_, offset, fraction(n, options_.raycast_steps));
    const int turns = n - options_.translation_steps;
    if (turns <= 0) return eq_3_translated(previous_, offset, fraction(n, options_.translation_steps));
    return eq_4_rotated(previous_, offset, fraction(turns, options_.rotation_steps));
  }

  // Tracking: vertices on the line from the tip through IntP of t−1; the deepest is the probe, and IntP its proxy. The
  // density saturates in bone: of equally deep vertices the nearest to IntP counts. Without one in bone IntP stays.
  template <ContactField Field>
  Status track(const Field& field, const Centreline<Scalar>& offset) noexcept {
    if (!collides(field, offset)) {
      intp_.reset();
      return Status::kOk;
    }
    const Vec3<Scalar> r = intp_.position() - offset.tip;
    const Scalar length = r.norm();
    const Centreline<Scalar> line{offset.tip, length > Scalar(0) ? Vec3<Scalar>(r / length) : offset.direction};
    line_values(field, tool_, line, now_.data());
    const Scalar v_max = now_[static_cast<std::size_t>(index_of_largest(now_.data(), tool_.count()))];
    if (!(v_max >= Scalar(0))) return Status::kOk;
    Vec3<Scalar> deepest = line.tip;
    Scalar nearest = std::numeric_limits<Scalar>::max();
    for (std::size_t i = 0; i < static_cast<std::size_t>(tool_.count()); ++i) {
      const Vec3<Scalar> vertex = line.at(tool_.heights()[i]);
      const Scalar distance = (vertex - intp_.position()).squaredNorm();
      if (now_[i] < v_max || !(distance < nearest)) continue;
      nearest = distance;
      deepest = vertex;
    }
    return move_proxy(field, deepest, intp_);
  }

  template <ContactField Field>
  [[nodiscard]] bool collides(const Field& field, const Centreline<Scalar>& line) noexcept {
    line_values(field, tool_, line, now_.data());
    return now_[static_cast<std::size_t>(index_of_largest(now_.data(), tool_.count()))] >= Scalar(0);
  }

  // Section 3.1.3: the shaft's torque.
  Vec3<Scalar> shaft_torque(const Centreline<Scalar>& probe, ContactSummary& summary) noexcept {
    const Vec3<Scalar> r = eq_8_lever();
    const Vec3<Scalar> g = eq_10_spring(eq_9_on_probe(r, probe.direction));
    const Vec3<Scalar> f = eq_11_reaction(g);
    const Vec3<Scalar> torque = eq_12_torque(r, f);
    contacts_[contact_count_++] = {report_.intersection, intp_.normal(), f};
    summary.shaft = true;
    summary.depth = std::max(summary.depth, static_cast<double>(g.norm()));
    report_.spring = g;
    report_.spring_m = g.norm();
    report_.lever_m = r.norm();
    report_.reaction_N = f.norm();
    report_.torque_Nm = torque.norm();
    return torque;
  }

  void set_previous(const Centreline<Scalar>& line) noexcept {
    previous_ = line;
    has_previous_ = true;
  }
  Tool tool_;
  ThesisLineOptions options_;
  SurfaceProxy<Scalar, Coulomb> tip_, intp_;
  std::vector<Scalar> before_, now_;  // values at the vertices, at steps n−1 and n
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
  Centreline<Scalar> previous_{};  // offset_{t−1}; a tool that stands still keeps it, so that small motions add up
  bool has_previous_ = false;
  bool embedded_ = false;  // the shaft is in bone and was never outside it
  LineReport<Scalar> report_{};
  std::array<ContactPoint<Scalar>, 2> contacts_{};
  std::size_t contact_count_ = 0;
};

template <class S>
ThesisLine(ToolDiscretization<LineCounts, S>, ThesisLineOptions = {}) -> ThesisLine<S>;

}  // namespace trephine
