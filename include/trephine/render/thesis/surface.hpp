// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/renderer.hpp>
#include <trephine/render/surface/ray_exits.hpp>
#include <trephine/render/surface/surface_options.hpp>
#include <trephine/tool/surface_discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

/// The Surface approximation as the thesis writes it (section 3.2): to read beside the thesis, and to measure
/// `SurfaceApproxRenderer` against. Where the thesis leaves a question open, this is its own reading.
namespace trephine::inline TREPHINE_ALIGNED {

struct ThesisSurfaceOptions {
  /// Secant stiffness [N/m] of the ball pressed on a plane at half its radius, as every renderer states it.
  double stiffness = 800;
  std::optional<double> k{};  ///< k of Eq. 15 [N/m], which replaces `stiffness`; about N times as stiff as it says
  double search_step = 0.5;   ///< largest step of a vertex's search for the surface, in voxels
  double jump = 0.005;        ///< largest motion of the tip between two ticks [m]; a longer one forgets held forces

  /// Throws std::invalid_argument for a number outside its range.
  void validate() const {
    for (const double v : {stiffness, k.value_or(1)})
      if (!(v > 0) || !is_finite(v)) refuse("ThesisSurfaceOptions", "stiffness must be > 0 N/m", v);
    if (!(search_step > 0 && search_step <= 4))
      refuse("ThesisSurfaceOptions", "search_step must be > 0 and at most 4 voxels", search_step);
    if (!(jump > 0)) refuse("ThesisSurfaceOptions", "jump must be > 0 m", jump);
  }
};

/// Eq. 16: k_res = N_total / N_colliding.
template <RealScalar Scalar>
[[nodiscard]] Scalar eq_16_k_res(int total, int colliding) noexcept {
  return static_cast<Scalar>(total) / static_cast<Scalar>(colliding);
}
/// Eq. 15: F_i = k k_res a_i.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> eq_15_spring_force(Scalar k, Scalar k_res, const Vec3<Scalar>& a) noexcept {
  return (k * k_res) * a;
}
/// Eq. 20: T_j = r_j × F_j.
template <RealScalar Scalar>
[[nodiscard]] Vec3<Scalar> eq_20_slice_torque(const Vec3<Scalar>& r, const Vec3<Scalar>& f) noexcept {
  return r.cross(f);
}

/// The Surface approximation as the thesis writes it. Vertices stand at the device's pose: there is no proxy and no
/// friction. The slices have torques without their forces.
template <RealScalar S = float>
class ThesisSurface {
 public:
  using Scalar = S;
  using Gradient = AnalyticGradient;  // not used: springs point to the groups' centres
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  /// Throws std::invalid_argument for options outside their range.
  explicit ThesisSurface(Tool tool, const ThesisSurfaceOptions& options = {})
      : tool_(std::move(tool)),
        options_(options),
        values_(static_cast<std::size_t>(tool_.padded())),
        exits_(tool_.periphery()),
        colliding_(static_cast<std::size_t>(tool_.periphery())),
        a_(static_cast<std::size_t>(tool_.periphery())),
        was_outside_(tool_.groups().size()),
        reports_(tool_.groups().size()),
        contacts_(static_cast<std::size_t>(tool_.periphery()) + tool_.groups().size()) {
    options.validate();
    const double depth = tool_.burr().tip_radius / 2;
    k_ = options.k.value_or(options.stiffness * depth / mean_plane_force(tool_, depth));
    reset();
  }

  /// One tick of section 3.2: the wrench at pose X_GT, about T's origin in G axes.
  template <ContactField Field>
  Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    Rendered<Scalar> result;
    const auto jump = static_cast<Scalar>(options_.jump);
    if (has_pose_ && !((X_GT.translation() - X_GT_.translation()).norm() <= jump)) {
      reset();
      result.status = Status::kJump;
    }
    X_GT_ = X_GT;
    has_pose_ = true;
    contact_count_ = 0;
    const auto& p = tool_.points();
    field.values(X_GT, p.x.data(), p.y.data(), p.z.data(), values_.data(), tool_.padded());
    find_springs(field);
    for (std::size_t j = 0; j < reports_.size(); ++j) {
      SliceReport<Scalar>& r = reports_[j];
      r.deep = is_in_bone(tool_.groups()[j].centre);
      result.status = worse(result.status, r.deep ? eq_18_19_held_force(j) : eq_17_group_force(j));
      const bool touches = r.deep || r.contacts > 0;
      result.contact.depth = std::max(result.contact.depth, depth_of(j));
      if (j == 0) {
        result.wrench.force = r.force;
        result.contact.tip = touches;
      } else if (touches) {
        r.torque = eq_20_slice_torque<Scalar>(r.lever_m * z_axis(X_GT), r.force);
        result.wrench.torque += r.torque;  // Eq. 21
        result.contact.shaft = true;
      }
    }
    result.contact.count = static_cast<int>(contact_count_);
    return result;
  }

  /// Clears all contact state.
  void reset() noexcept {
    for (std::size_t j = 0; j < reports_.size(); ++j) reports_[j] = {.lever_m = tool_.groups()[j].height};
    std::fill(was_outside_.begin(), was_outside_.end(), std::uint8_t{0});
    contact_count_ = 0;
    has_pose_ = false;
  }

  /// k of Eq. 15 in use [N/m].
  [[nodiscard]] double k() const noexcept { return k_; }
  [[nodiscard]] const ThesisSurfaceOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Tool& tool() const noexcept { return tool_; }
  [[nodiscard]] const Burr& shape() const noexcept { return tool_.burr(); }
  /// Reports of all groups: the ball first, then the slices from the tip up (Fig. 23, 24).
  [[nodiscard]] std::span<const SliceReport<Scalar>> groups() const noexcept { return reports_; }
  [[nodiscard]] std::span<const SliceReport<Scalar>> slices() const noexcept { return groups().subspan(1); }
  /// Contacts of the last tick, in G: a spring each; a group with a held force has one, at its centre.
  [[nodiscard]] std::span<const ContactPoint<Scalar>> contacts() const noexcept {
    return {contacts_.data(), contact_count_};
  }
  /// The device's pose: the Surface approximation has no proxy. The same holds for the next two.
  [[nodiscard]] Pose<Scalar> proxy_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept { return X_GT_; }
  [[nodiscard]] Pose<Scalar> visual_pose() const noexcept { return X_GT_; }

 private:
  [[nodiscard]] bool is_in_bone(int vertex) const noexcept {
    return values_[static_cast<std::size_t>(vertex)] >= Scalar(0);
  }

  // The lengths |a_i| of Eq. 15, of vertices that collide in groups whose centre is outside: the way to the isosurface
  // toward the centre. All others get 0.
  template <ContactField Field>
  void find_springs(const Field& field) noexcept {
    std::fill(a_.begin(), a_.end(), Scalar(0));
    exits_.clear();
    for (const auto& group : tool_.groups()) {
      if (is_in_bone(group.centre)) continue;
      for (int i = group.first; i < group.first + group.count; ++i) {
        if (!is_in_bone(i)) continue;
        colliding_[static_cast<std::size_t>(exits_.count())] = static_cast<std::size_t>(i);
        exits_.add(tool_.points()[i], tool_.inward()[i], tool_.radius(i), values_[static_cast<std::size_t>(i)]);
      }
    }
    exits_.search(field, X_GT_, static_cast<Scalar>(options_.search_step) * field.voxel());
    for (int s = 0; s < exits_.count(); ++s) a_[colliding_[static_cast<std::size_t>(s)]] = exits_[s];
  }

  // The springs |a_i| of group j.
  [[nodiscard]] std::span<const Scalar> springs(std::size_t j) const noexcept {
    const auto& group = tool_.groups()[j];
    return std::span<const Scalar>(a_).subspan(static_cast<std::size_t>(group.first),
                                               static_cast<std::size_t>(group.count));
  }

  // Eq. 17: F_j = Σ F_i over the group's colliding vertices.
  Status eq_17_group_force(std::size_t j) noexcept {
    const auto& group = tool_.groups()[j];
    const auto a = springs(j);
    SliceReport<Scalar>& r = reports_[j];
    r = {.lever_m = group.height};
    was_outside_[j] = 1;
    r.contacts = static_cast<int>(std::count_if(a.begin(), a.end(), [](Scalar length) { return length > Scalar(0); }));
    for (int i = 0; i < group.count; ++i) {
      const Scalar length = a[static_cast<std::size_t>(i)];
      if (!(length > Scalar(0))) continue;
      const Vec3<Scalar> d = X_GT_.linear() * tool_.inward()[group.first + i];
      const Scalar k_res = eq_16_k_res<Scalar>(group.count, r.contacts);
      const Vec3<Scalar> f = eq_15_spring_force<Scalar>(static_cast<Scalar>(k_), k_res, length * d);
      r.force += f;
      contacts_[contact_count_++] = {X_GT_ * tool_.points()[group.first + i] + length * d, d, f};
    }
    return Status::kOk;
  }

  // Eq. 18 (sphere), 19 (slice): a group whose centre is in bone holds its force of t−1, which a group that was never
  // outside does not have.
  Status eq_18_19_held_force(std::size_t j) noexcept {
    SliceReport<Scalar>& r = reports_[j];
    r.contacts = 0;
    const Vec3<Scalar> normal = r.force.squaredNorm() > Scalar(0) ? r.force.normalized() : Vec3<Scalar>::Zero();
    contacts_[contact_count_++] = {X_GT_ * tool_.points()[tool_.groups()[j].centre], normal, r.force};
    return was_outside_[j] != 0 ? Status::kOk : Status::kStartedInside;
  }

  // Depth of group j: its longest spring, or its radius with its centre in bone [m].
  [[nodiscard]] double depth_of(std::size_t j) const noexcept {
    const auto a = springs(j);
    return static_cast<double>(reports_[j].deep ? tool_.groups()[j].radius : *std::max_element(a.begin(), a.end()));
  }

  // Force over k of the ball `depth` [m] in a half space, by Eq. 15 to 17: the component along the plane's normal,
  // averaged over normals, so that a stiffness does not depend on how the ball is turned.
  [[nodiscard]] static double mean_plane_force(const Tool& tool, double depth) {
    constexpr int kDirections = 720;
    const auto& ball = tool.groups()[0];
    const double radius = static_cast<double>(ball.radius);
    double mean = 0;
    for (const Vec3d& n : spread_over_sphere(kDirections).directions) {
      int colliding = 0;
      double sum = 0;
      for (int i = 0; i < ball.count; ++i) {
        const double cosine = tool.inward()[i].template cast<double>().dot(n);
        const double vertex_depth = depth - radius * (1 - cosine);
        if (!(vertex_depth > 0 && cosine > 0)) continue;
        ++colliding;
        sum += vertex_depth;  // a_i · n
      }
      if (colliding > 0) mean += eq_16_k_res<double>(ball.count, colliding) * sum / kDirections;
    }
    return mean;
  }

  Tool tool_;
  ThesisSurfaceOptions options_;
  double k_ = 0;
  std::vector<Scalar> values_;             // density minus isovalue at all vertices
  RayExits<Scalar> exits_;                 // ways to the isosurface
  std::vector<std::size_t> colliding_;     // vertex of each way
  std::vector<Scalar> a_;                  // |a_i| of each vertex of the peripheries [m]
  std::vector<std::uint8_t> was_outside_;  // of each group: 1 once its centre was outside bone
  std::vector<SliceReport<Scalar>> reports_;
  std::vector<ContactPoint<Scalar>> contacts_;
  std::size_t contact_count_ = 0;
  bool has_pose_ = false;
  Pose<Scalar> X_GT_ = Pose<Scalar>::Identity();
};

template <class S>
ThesisSurface(ToolDiscretization<SurfaceCounts, S>, ThesisSurfaceOptions = {}) -> ThesisSurface<S>;

}  // namespace trephine
