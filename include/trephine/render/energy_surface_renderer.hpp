// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/vertex_contacts.hpp>
#include <trephine/render/depth_source.hpp>
#include <trephine/render/energy_law.hpp>
#include <trephine/render/renderer.hpp>

#include <vector>

namespace trephine {

struct EnergySurfaceOptions {
  /// Secant stiffness [N/m] of the tip pressed on a plane at δ = R/2, as everywhere.
  double stiffness = 800;
  /// A tip that moves farther than this between two ticks [m] has jumped.
  double jump = 0.005;

  void validate() const {
    if (!(stiffness > 0) || !std::isfinite(stiffness))
      refuse("EnergySurfaceOptions", "stiffness must be > 0 N/m", stiffness);
    if (!(jump > 0)) refuse("EnergySurfaceOptions", "jump must be > 0 m", jump);
  }
};

/// The Surface approximation's vertices with forces that come from an energy. With φ_i the depth of vertex i and w_i
/// the area it stands for,
///
///     U = ½ k Σ w_i max(φ_i, 0)²,    f_i = k w_i φ_i (−∇φ_i) at the vertex,    T = Σ (x_i − p) × f_i
///
/// which is exactly −∂U/∂pose, so closed paths do no work; unlike springs toward a centre (Eq. 15), which are the
/// gradient of no energy for any finite number of vertices. On a plane the direction is exact whatever the count.
/// Inside the bone there is a direction as deep as the depths reach, so no force has to be held (Eq. 18). Penalty
/// contact at the device's pose: the tool sinks in as far as its springs let it; no proxy, no friction. This is
/// `DepthLaw`; `RayLaw` keeps Eq. 15's ways out along rays and has an energy too, for shallow contact alone.
///
/// Work a tick: one sample a vertex, one gradient for each in bone; `RayLaw` casts a ray for each instead.
/// kStartedInside: a vertex is deeper than the law tells (DepthLaw: than the depths reach; RayLaw: its group's centre
/// is in bone, or its ray grazes): it does not push.
template <RealScalar S, DepthSource Depth = FromDepthMap, EnergyLaw<S> Law = DepthLaw>
class EnergySurfaceRenderer : public DepthReader<S, Depth> {
 public:
  using Scalar = S;
  using Gradient = AnalyticGradient;
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  /// Throws std::invalid_argument for options outside their range.
  EnergySurfaceRenderer(Tool tool, Depth depth, const EnergySurfaceOptions& options = {})
      : DepthReader<S, Depth>(depth), tool_(std::move(tool)), options_(options), vertices_(tool_), law_(tool_) {
    options.validate();
    contacts_.resize(static_cast<std::size_t>(tool_.periphery()));
    k_ = options.stiffness / Law::per_stiffness(tool_.burr().tip_radius);
  }

  template <PenetrationField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> out;
    const bool jumped = started_ && !((X_GT.translation() - X_GT_.translation()).norm() <= Scalar(options_.jump));
    if (jumped) out.status = Status::kJump;
    started_ = true;
    X_GT_ = X_GT;
    vertices_.look(field, tool_, X_GT.template cast<double>());
    law_.look(field, tool_, X_GT, vertices_.found());
    Wrenchd sum;
    contact_count_ = 0;
    energy_ = 0;
    for (const VertexContact& c : vertices_.found()) {
      const double k = k_ * static_cast<double>(tool_.areas()[static_cast<std::size_t>(c.vertex)]);
      const EnergyTerm t = law_.term(contact_count_, c);
      const Vec3d force = k * t.force;
      sum += Wrenchd::of_force_at(force, t.lever);
      sum.torque += k * t.couple;
      energy_ += k * t.energy;
      if (!t.known) out.status = worse(out.status, Status::kStartedInside);
      contacts_[contact_count_++] =
          contact_point<Scalar>({c.vertex, c.depth, t.out, t.lever}, X_GT.translation().template cast<double>(), force);
      vertices_.tell(c, out.contact);
    }
    out.wrench = {sum.force.template cast<Scalar>(), sum.torque.template cast<Scalar>()};
    out.contact.depth = vertices_.deepest();
    return out;
  }

  void reset() noexcept {
    started_ = false;
    contact_count_ = 0;
    energy_ = 0;
    vertices_.forget();
  }

  [[nodiscard]] const EnergySurfaceOptions& options() const noexcept { return options_; }
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  /// U of the last tick [J].
  [[nodiscard]] double energy() const noexcept { return energy_; }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// No proxy: all three are the device's pose.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return X_GT_; }

 private:
  Tool tool_;
  EnergySurfaceOptions options_;
  VertexContacts<Scalar, FixedVertices> vertices_;
  [[no_unique_address]] Law law_;
  double k_ = 0;  // foundation stiffness [N/m³]
  double energy_ = 0;
  bool started_ = false;
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
  std::size_t contact_count_ = 0;
  std::vector<ContactPoint<Scalar>> contacts_;
};

template <RealScalar S, DepthSource Depth>
EnergySurfaceRenderer(ToolDiscretization<SurfaceCounts, S>, Depth, EnergySurfaceOptions = {})
    -> EnergySurfaceRenderer<S, Depth>;

}  // namespace trephine
