// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/renderer.hpp>
#include <trephine/render/surface/deep_contact.hpp>
#include <trephine/render/surface/patch_quadrature.hpp>
#include <trephine/render/surface/plane_law.hpp>
#include <trephine/render/surface/ray_exits.hpp>
#include <trephine/render/surface/shared_groups.hpp>
#include <trephine/render/surface/surface_options.hpp>
#include <trephine/render/surface/vertex_samples.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Surface approximation (thesis 3.2): penalty springs on the vertices of a ball and of slices along the shaft.
///
/// Each vertex in bone has a spring toward its group's centre, as long as its exit distance in that direction (Eq.
/// 15–17), integrated over the vertex's patch. `DeepContact` gives the force of a group whose centre is in bone (Eq.
/// 18, 19). Slices give force, and a torque about the ball's centre (Eq. 20, 21). Vertices follow the device's pose:
/// there is no proxy and no friction, and the tool penetrates as far as its springs yield.
///
/// Work per tick: `padded` samples if a vertex may touch, none if the tool is beyond the volume. Each vertex in bone
/// costs a ray of `RayExits`, and a gradient for it and for its neighbours. A group whose centre is in bone costs a
/// proxy's step instead. A group without a vertex in bone costs a gradient and a sample, and the gradients of its
/// neighbours if bone is within the patch's reach.
///
/// Write `SurfaceApproxRenderer{ToolDiscretization{burr, SurfaceCounts{}}, SurfaceOptions{}}`.
template <RealScalar S, class Shape = Burr>
class SurfaceApproxRenderer {
  // Depth, in radii of the tip, at which `SurfaceOptions::stiffness` is the secant stiffness.
  static constexpr double kReferenceDepth = 0.5;

 public:
  using Scalar = S;
  using Gradient = AnalyticGradient;
  using Tool = ToolDiscretization<SurfaceCounts, Scalar, Shape>;

  /// Throws std::invalid_argument for options outside their range.
  explicit SurfaceApproxRenderer(Tool tool, const SurfaceOptions& options = {})
      : tool_(std::move(tool)),
        options_(options),
        vertices_(tool_.points()),
        samples_(tool_),
        exits_(tool_.periphery()),
        hits_(static_cast<std::size_t>(tool_.periphery())),
        spring_length_(static_cast<std::size_t>(tool_.periphery())),
        patches_(tool_),
        group_hit_(tool_.groups().size()),
        is_deep_(tool_.groups().size()),
        is_moved_(tool_.groups().size()),
        deep_(tool_.groups().size()),
        reports_(tool_.groups().size()) {
    options.validate();
    contacts_.resize(static_cast<std::size_t>(tool_.periphery()) + tool_.groups().size());
    k_per_stiffness_ = burr().tip_radius * kReferenceDepth / mean_plane_force(tool_, 0, kReferenceDepth);
    k_ = options.stiffness * k_per_stiffness_;
    // A stiffness that overflows would give kNonFinite at every contact.
    const auto representable = [&](double v) {
      if (v <= static_cast<double>(std::numeric_limits<Scalar>::max())) return static_cast<Scalar>(v);
      refuse("SurfaceApproxRenderer", "stiffness must be finite in the renderer's precision", options.stiffness);
    };
    static_cast<void>(representable(k_));
    for (std::size_t g = 0; g < tool_.groups().size(); ++g)
      edge_forces_.push_back(representable(k_ * mean_plane_force(tool_, g, 1.0)));
    clear_reports();
    if (options.budget) shared_.emplace(*options.budget, tool_, k_, edge_forces_);
  }

  /// Computes the wrench on the tool at pose X_GT, about T's origin in G axes.
  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> result;
    result.status = begin_tick(X_GT);
    bool touches = samples_.update(field, tool_, X_GT_);
    if (touches) {
      result.status = worse(result.status, place_groups(field));
      touches = find_springs(field);
    }
    if (!touches) {
      if (!is_idle_) {
        is_idle_ = true;
        clear_reports();
      }
      return result;
    }
    is_idle_ = false;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g)
      if (!remains_free(g)) evaluate_group(g, reports_[g], result.contact);
    if (shared_) shared_->share(tool_, spring_length_, reports_, {contacts_.data(), contact_count_});
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      SliceReport<Scalar>& r = reports_[g];
      if (g == 0) {
        result.wrench.force += r.force;
        result.contact.tip = r.contacts > 0 || r.deep;
        continue;
      }
      if (r.contacts == 0 && !r.deep) continue;
      r.torque = (r.lever_m * z_axis(X_GT)).cross(r.force);  // Eq. 20
      result.wrench.torque += r.torque;                      // Eq. 21
      result.wrench.force += r.force;
      result.contact.shaft = result.contact.shaft || r.contacts > 0 || r.deep;
    }
    result.contact.count = static_cast<int>(contact_count_);
    return result;
  }

  /// Clears all contact state.
  void reset() noexcept {
    for (auto& d : deep_) d.reset();
    clear_reports();
    contact_count_ = 0;
    has_pose_ = false;
    is_idle_ = false;
  }

  /// Reports of all groups: the ball first, then the slices from the tip up.
  [[nodiscard]] std::span<const SliceReport<Scalar>> groups() const noexcept { return reports_; }
  /// Reports of the slices alone.
  [[nodiscard]] std::span<const SliceReport<Scalar>> slices() const noexcept {
    return std::span<const SliceReport<Scalar>>(reports_).subspan(1);
  }
  /// k of the foundation [N/m³] (`plane_law`).
  [[nodiscard]] double foundation_stiffness() const noexcept { return k_; }
  [[nodiscard]] const SurfaceOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  /// The burr, or one of the tool's size.
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  /// The part that cuts, of a tool that is no burr.
  [[nodiscard]] const auto& cutting_head() const noexcept
    requires requires(const Tool& t) { t.cutting_head(); }
  {
    return tool_.cutting_head();
  }
  /// Contacts of the last tick, in G.
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// Secant stiffness [N/m] of the tip at δ = R/2.
  [[nodiscard]] double stiffness() const noexcept { return options_.stiffness; }
  /// Tangent stiffness [N/m] of the tip pressed on a plane with `force` [N], within the budget; for 0 N at δ = R/2.
  [[nodiscard]] double tangent_stiffness(double force) const {
    const double k = plane_tangent(tool_, k_, force);
    return options_.budget ? std::min(k, options_.budget->linear) : k;
  }
  /// The device's pose: the Surface approximation has no proxy. The same holds for the next two.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return X_GT_; }

 private:
  [[nodiscard]] const Burr& burr() const noexcept { return tool_.burr(); }

  // Stores the new pose. A motion beyond `jump` resets deep contact.
  [[nodiscard]] Status begin_tick(const Pose<Scalar>& X_GT) noexcept {
    const bool jumped =
        has_pose_ && !((X_GT.translation() - X_GT_.translation()).norm() <= static_cast<Scalar>(options_.jump));
    if (jumped) reset();
    has_previous_ = has_pose_;
    previous_X_GT_ = X_GT_;
    X_GT_ = X_GT;
    has_pose_ = true;
    contact_count_ = 0;
    return jumped ? Status::kJump : Status::kOk;
  }

  void clear_reports() noexcept {
    for (std::size_t g = 0; g < reports_.size(); ++g) reports_[g] = {.lever_m = tool_.groups()[g].height};
  }

  // True if group g is free of contact in this tick and was so in the previous tick: its report stays as it is.
  [[nodiscard]] bool remains_free(std::size_t g) const noexcept {
    return group_hit_[g] == 0 && reports_[g].contacts == 0 && !reports_[g].deep && !is_deep(g);
  }

  // Computes force, contacts and report of group g.
  void evaluate_group(std::size_t g, SliceReport<Scalar>& r, ContactSummary& summary) noexcept {
    const auto& group = tool_.groups()[g];
    r = {.deep = is_deep(g), .lever_m = group.height};
    if (!r.deep && group_hit_[g] == 0) return;
    const std::size_t first_contact = contact_count_;
    // Sum of the vertices' forces times their offsets along the shaft.
    Vec3<Scalar> moment = group_hit_[g] != 0 ? sum_springs(g, r, summary) : Vec3<Scalar>::Zero();
    const Vec3<Scalar> c = X_GT_ * tool_.points()[group.centre];
    if (r.deep) {
      r.force = deep_[g].force(group.radius, edge_forces_[g], r.force);
      moment *= deep_[g].vertex_share(group.radius);
      summary.depth = std::max(summary.depth, static_cast<double>(group.radius));
      r.contacts = 0;
      contact_count_ = first_contact;
      contacts_[contact_count_++] = {c, safe_direction(r.force), r.force};
    } else {
      scale_contacts(first_contact, r.force);
      deep_[g].update_outside(c);
    }
    const Vec3<Scalar> direction = safe_direction(r.force);
    if (const Scalar whole = direction.dot(r.force); whole > Scalar(0)) r.lever_m += direction.dot(moment) / whole;
  }

  // Sums the springs of group g's vertices: their force and number go to `r`, and their terms of the sum to contacts,
  // which scale_contacts turns into forces. Returns the forces' moment along the shaft.
  Vec3<Scalar> sum_springs(std::size_t g, SliceReport<Scalar>& r, ContactSummary& summary) noexcept {
    const auto& group = tool_.groups()[g];
    const Vec3<Scalar> c = X_GT_ * vertices_[group.centre];
    Vec3<Scalar> sum = Vec3<Scalar>::Zero(), moment = sum;
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Scalar a = spring_length_[static_cast<std::size_t>(i)];
      if (!(a > Scalar(0))) continue;
      const PatchSpring<Scalar>& spring = patches_.spring(i);
      const Vec3<Scalar> d = X_GT_.linear() * spring.direction;
      const Scalar radius = tool_.radius(i);
      const Vec3<Scalar> term = (tool_.areas()[static_cast<std::size_t>(i)] * a) * d;
      sum += term;
      summary.depth = std::max(summary.depth, static_cast<double>(a));
      Vec3<Scalar> shift = (std::min(spring.surface_distance, radius) - a) * d;
      if (g > 0) {
        const Vec3<Scalar> along = tool_.along(i);
        shift += spring.shaft_offset * (X_GT_.linear() * along);
        moment += (spring.shaft_offset / along.z()) * term;  // its line of action meets the axis so much higher
      }
      const Vec3<Scalar> position = c - (radius - a) * d;
      contacts_[contact_count_++] = {position + shift, d, term};
      ++r.contacts;
    }
    r.force = static_cast<Scalar>(k_) * sum;  // Eq. 17
    return static_cast<Scalar>(k_) * moment;
  }

  // Finds the groups whose centre is in bone, and moves them out.
  template <ContactField Field>
  Status place_groups(const Field& field) noexcept {
    Status status = Status::kOk;
    bool moved = false;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      const int centre = tool_.groups()[g].centre;
      is_deep_[g] = samples_[centre] >= Scalar(0) ? 1 : 0;
      Vec3<Scalar> shift = Vec3<Scalar>::Zero();
      if (is_deep_[g] != 0) {
        // A group out of contact does not update its deep state every tick: it catches up with the previous tick here.
        if (reports_[g].contacts == 0 && !reports_[g].deep && has_previous_)
          deep_[g].update_outside(previous_X_GT_ * tool_.points()[centre]);
        status =
            worse(status, deep_[g].move_out(field, X_GT_ * tool_.points()[centre], tool_.groups()[g].radius, shift));
      }
      const bool moves = !shift.isZero(Scalar(0));
      if (moves || is_moved_[g] != 0) place_group(g, X_GT_.linear().transpose() * shift);
      is_moved_[g] = moves ? 1 : 0;
      moved = moved || moves;
    }
    if (moved) samples_.resample(field, tool_, vertices_, X_GT_, is_moved_);
    return status;
  }

  // Places group g's vertices `shift` [m] off the tool's, in T.
  void place_group(std::size_t g, const Vec3<Scalar>& shift) noexcept {
    const auto& group = tool_.groups()[g];
    const PointArrays<Scalar>& p = tool_.points();
    const auto place = [&](int i) {
      const auto n = static_cast<std::size_t>(i);
      vertices_.x[n] = p.x[n] + shift.x();
      vertices_.y[n] = p.y[n] + shift.y();
      vertices_.z[n] = p.z[n] + shift.z();
    };
    for (int i = group.first; i < group.first + group.count; ++i) place(i);
    place(group.centre);
  }

  // Computes the spring lengths a_i of Eq. 15 for all groups whose centre is outside bone: from a vertex in bone toward
  // the centre, up to the first surface. Vertices without contact get 0. Returns false if nothing is in contact.
  template <ContactField Field>
  [[nodiscard]] bool find_springs(const Field& field) noexcept {
    std::fill(spring_length_.begin(), spring_length_.end(), Scalar(0));
    exits_.clear();
    bool deep = false;
    for (std::size_t g = 0; g < tool_.groups().size(); ++g) {
      group_hit_[g] = 0;
      deep = deep || is_deep(g);
    }
    for (int first = 0; first < tool_.periphery(); first += kBatch) add_hits(first);
    exits_.search(field, X_GT_, static_cast<Scalar>(options_.search_step) * field.voxel());
    for (int j = 0; j < exits_.count(); ++j)
      spring_length_[static_cast<std::size_t>(hits_[static_cast<std::size_t>(j)])] = exits_[j];
    const std::span<const int> hits(hits_.data(), static_cast<std::size_t>(exits_.count()));
    patches_.integrate(field, tool_, vertices_, X_GT_, samples_.values(), hits, exits_.covers(), spring_length_,
                       group_hit_);
    return deep || std::find(group_hit_.begin(), group_hit_.end(), std::uint8_t{1}) != group_hit_.end();
  }

  // Adds a ray for each vertex in bone of a batch, in groups whose centre is outside. Few vertices are in bone: the
  // search tests eight at a time.
  void add_hits(int first) noexcept {
    const std::span<const Scalar> values = samples_.values();
    const auto from = static_cast<std::size_t>(first);
    const std::size_t m = std::min(values.size() - from, std::size_t{kBatch}) / kLane * kLane;
    std::array<std::uint8_t, kBatch> in_bone;
    for (std::size_t i = 0; i < m; ++i) in_bone[i] = values[from + i] >= Scalar(0) ? 1 : 0;
    for (std::size_t eight = 0; eight < m; eight += 8) {
      std::uint64_t any;
      std::memcpy(&any, in_bone.data() + eight, sizeof(any));
      if (any == 0) continue;
      for (std::size_t k = eight; k < eight + 8; ++k) {
        const int i = first + static_cast<int>(k);
        if (in_bone[k] == 0 || i >= tool_.periphery()) continue;
        const std::size_t g = tool_.group_of(i);
        if (samples_[tool_.groups()[g].centre] >= Scalar(0)) continue;
        hits_[static_cast<std::size_t>(exits_.count())] = i;
        exits_.add(vertices_[i], tool_.inward()[i], tool_.radius(i), values[from + k]);
        group_hit_[g] = 1;
      }
    }
  }

  // True if the group's centre is in bone.
  [[nodiscard]] bool is_deep(std::size_t g) const noexcept { return is_deep_[g] != 0; }

  // Turns the terms of a group's contacts into forces that sum to the group's force along its direction.
  void scale_contacts(std::size_t first, const Vec3<Scalar>& force) noexcept {
    Vec3<Scalar> sum = Vec3<Scalar>::Zero();
    for (std::size_t i = first; i < contact_count_; ++i) sum += contacts_[i].force;
    const Scalar norm2 = sum.squaredNorm();
    const Scalar scale = norm2 > Scalar(0) ? force.dot(sum) / norm2 : Scalar(0);
    for (std::size_t i = first; i < contact_count_; ++i) contacts_[i].force *= scale;
  }

  [[nodiscard]] static Vec3<Scalar> safe_direction(const Vec3<Scalar>& v) noexcept {
    const Scalar n = v.norm();
    return n > Scalar(0) ? Vec3<Scalar>(v / n) : Vec3<Scalar>::Zero();
  }

  Tool tool_;
  SurfaceOptions options_;
  double k_ = 0;                     // of the foundation [N/m³]
  double k_per_stiffness_ = 1;       // k over the secant stiffness at kReferenceDepth
  std::vector<Scalar> edge_forces_;  // of each group pressed into a plane up to its centre [N]
  std::optional<SharedGroups<Scalar>> shared_;
  PointArrays<Scalar> vertices_;  // the tool's points, of groups moved out of bone where they are then
  VertexSamples<Scalar> samples_;
  RayExits<Scalar> exits_;
  std::vector<int> hits_;              // vertex of each ray
  std::vector<Scalar> spring_length_;  // of each vertex of the periphery [m]; 0: no contact
  PatchQuadrature<Scalar> patches_;
  std::vector<std::uint8_t> group_hit_;  // of each group: 1 if one of its vertices or patches is in bone
  std::vector<std::uint8_t> is_deep_;    // of each group: 1 if its centre is in bone
  std::vector<std::uint8_t> is_moved_;   // of each group: 1 if its vertices are off the tool's points
  std::vector<DeepContact<Scalar>> deep_;
  std::vector<SliceReport<Scalar>> reports_;
  std::vector<ContactPoint<Scalar>> contacts_;
  std::size_t contact_count_ = 0;
  bool is_idle_ = false;  // the previous tick had no contact, and reports are clear
  bool has_pose_ = false;
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
  bool has_previous_ = false;  // the previous tick's pose is valid: no start, no jump
  Pose<Scalar> previous_X_GT_ = Pose<Scalar>::Identity();
};

template <class S, class Shape>
SurfaceApproxRenderer(ToolDiscretization<SurfaceCounts, S, Shape>, SurfaceOptions = {})
    -> SurfaceApproxRenderer<S, Shape>;

}  // namespace trephine
