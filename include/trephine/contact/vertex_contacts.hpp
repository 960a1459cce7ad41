// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <cstddef>
#include <limits>
#include <vector>

namespace trephine {

/// A contact field whose values say how deep a point is: `metres()` per unit of value; `clearance(value)` [m], below
/// which no bone is near, and its inverse; and a gradient that does not show the cells. A DepthField tells distances; a
/// DensityField depths of a kind and no clearance.
// clang-format off
template <class F>
concept PenetrationField = ContactField<F> && requires(const F& f, typename F::Scalar v, const Vec3<typename F::Scalar>& p) {
  { f.metres() } noexcept -> std::same_as<typename F::Scalar>;
  { f.clearance(v) } noexcept -> std::same_as<typename F::Scalar>;
  { f.value_at_clearance(v) } noexcept -> std::same_as<typename F::Scalar>;
  { f.smooth_gradient(p) } noexcept -> std::same_as<Vec3<typename F::Scalar>>;
};
// clang-format on

/// A place where the tool is in bone. With φ its depth and X the tool's pose, its spring has the energy ½ k φ², and
/// pushes with k φ along `out` = −∇φ there: the energy's gradient, in translation and in rotation.
struct VertexContact {
  int vertex = 0;
  double depth = 0;             ///< φ [m]; > 0 where it touches
  Vec3d out = Vec3d::Zero();    ///< −∇φ in G axes; of length 1 up to interpolation
  Vec3d lever = Vec3d::Zero();  ///< from T's origin to the place, in G axes [m]
};

/// A contact of a tool whose origin is at p_GT, with the force on the tool there, for logs and drawings.
template <RealScalar Scalar>
[[nodiscard]] ContactPoint<Scalar> contact_point(const VertexContact& c, const Vec3d& p_GT,
                                                 const Vec3d& force) noexcept {
  const double length = c.out.norm();
  const Vec3d normal = length > 0 ? Vec3d(c.out / length) : Vec3d(Vec3d::Zero());
  return {(p_GT + c.lever).template cast<Scalar>(), normal.template cast<Scalar>(), force.template cast<Scalar>()};
}

/// Where a vertex looks for bone: at itself, with the interpolant's own gradient, so that forces are exactly those of
/// an energy …
struct FixedVertices {
  static constexpr bool kGlide = false;
};
/// … or at the deepest place of the patch of tool that it stands for, found from the gradient at the vertex: a ball of
/// few vertices touches as a ball does and not as their polyhedron, and each place's normal is that of its whole
/// neighbourhood. By the envelope theorem the force at a deepest place is the energy's gradient there as well.
struct GlidingVertices {
  static constexpr bool kGlide = true;
};

/// What of a tool is in bone, a place per vertex at most, found by a sample or two a vertex without search or ray.
/// Within a tick, poses near the first look only at vertices that can touch there. Allocates at construction alone.
template <RealScalar Scalar, class Vertices = GlidingVertices>
class VertexContacts {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  explicit VertexContacts(const Tool& tool)
      : count_(tool.periphery()),
        padded_(padded_to_lane(tool.periphery())),
        ball_(tool.groups()[0].count),
        values_(static_cast<std::size_t>(tool.padded())) {
    groups_.resize(tool.groups().size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      groups_[g].first = tool.groups()[g].first;
      groups_[g].last = tool.groups()[g].first + tool.groups()[g].count;
      for (int i = groups_[g].first; i < groups_[g].last; ++i) {
        groups_[g].farthest = std::max(groups_[g].farthest, static_cast<double>(tool.points()[i].norm()));
        group_of_.push_back(g);
      }
      farthest_ = std::max(farthest_, groups_[g].farthest);
    }
    for (PointArrays<Scalar>* points : {&near_, &places_, &gradients_})
      for (auto* v : {&points->x, &points->y, &points->z}) v->resize(static_cast<std::size_t>(padded_));
    near_values_.resize(static_cast<std::size_t>(padded_));
    near_vertices_.resize(static_cast<std::size_t>(padded_));
    place_vertices_.resize(static_cast<std::size_t>(padded_));
    found_.resize(static_cast<std::size_t>(count_));
    if constexpr (Vertices::kGlide) {
      // A quarter wider than a disc of the same area, so that patches leave no gaps.
      ball_reach_ = std::min(Scalar(1), Scalar(1.25) * std::sqrt(Scalar(4) / static_cast<Scalar>(ball_)));
      if (tool.groups().size() > 1)
        ring_reach_ = std::numbers::pi_v<Scalar> / static_cast<Scalar>(tool.groups()[1].count);
      ball_cosine_ = std::cos(ball_reach_);
      ring_cosine_ = std::cos(ring_reach_);
    }
  }

  /// Farthest that any vertex moves between two poses that are `step` [m] and `turn` [rad] apart.
  [[nodiscard]] double motion(double step, double turn) const noexcept { return step + turn * farthest_; }

  [[nodiscard]] std::span<const VertexContact> found() const noexcept { return {found_.data(), touching_}; }
  /// Those and, after them, the places up to half a voxel outside (`depth` < 0; gliding vertices alone): where a step
  /// may touch. Their `out` is the interpolant's own.
  [[nodiscard]] std::span<const VertexContact> near() const noexcept { return {found_.data(), found_count_}; }
  /// Adds a contact to a tick's summary.
  void tell(const VertexContact& c, ContactSummary& summary) const noexcept {
    ++summary.count;
    const bool tip = c.vertex < ball_;
    summary.tip = summary.tip || tip;
    summary.shaft = summary.shaft || !tip;
  }
  /// The share of a motion by `step` [m] and `turn` [rad] that takes no vertex that does not touch farther than `more`
  /// [m] beyond what is known to be free; at most 1.
  [[nodiscard]] double free_share(double step, double turn, double more) const noexcept {
    double share = 1;
    for (const Group& g : groups_) share = std::min(share, (g.clearance + more) / (step + turn * g.farthest));
    return share;
  }
  [[nodiscard]] double deepest() const noexcept { return deepest_; }

  /// All vertices at pose X_GT.
  template <PenetrationField Field>
  void look(const Field& field, const Tool& tool, const Posed& X_GT) noexcept {
    const Pose<Scalar> X = X_GT.template cast<Scalar>();
    const auto& p = tool.points();
    field.values(X, p.x.data(), p.y.data(), p.z.data(), values_.data(), padded_);
    near_count_ = 0;
    for (Group& g : groups_) pick_near(field, tool, g);
    pad(near_, near_count_);
    X_looked_ = X_GT;
    touch(field, tool, X, 0, 0);
  }

  /// The same; at a pose so near the last one of `look` that no other vertex can touch, only of those that can.
  template <PenetrationField Field>
  void look_near(const Field& field, const Tool& tool, const Posed& X_GT) noexcept {
    const double step = (X_GT.translation() - X_looked_.translation()).norm();
    const double turn = turn_between(X_looked_, X_GT).norm();
    for (const Group& g : groups_)
      if (step + turn * g.farthest > g.far_clearance) return look(field, tool, X_GT);
    const Pose<Scalar> X = X_GT.template cast<Scalar>();
    if (near_count_ > 0)
      field.values(X, near_.x.data(), near_.y.data(), near_.z.data(), near_values_.data(), padded_to_lane(near_count_));
    touch(field, tool, X, step, turn);
  }

 private:
  static void put(PointArrays<Scalar>& points, int at, const Vec3<Scalar>& p) noexcept {
    const auto n = static_cast<std::size_t>(at);
    points.x[n] = p.x();
    points.y[n] = p.y();
    points.z[n] = p.z();
  }
  static void pad(PointArrays<Scalar>& points, int count) noexcept {
    if (count == 0) return;
    for (int n = count; n < padded_to_lane(count); ++n) put(points, n, points[count - 1]);
  }

  /// Vertices first … last − 1: of the ball or of a slice.
  struct Group {
    int first = 0;
    int last = 0;
    double farthest = 0;       // from T's origin [m]
    double far_clearance = 0;  // of those that are not near, at X_looked_ [m]
    double clearance = 0;      // of all that do not touch [m]
  };

  /// Of a group's vertices those that can touch within a voxel from here.
  template <PenetrationField Field>
  void pick_near(const Field& field, const Tool& tool, Group& group) noexcept {
    group.far_clearance = std::numeric_limits<double>::infinity();
    if (group.first == group.last) return;
    const Scalar reach = reach_of(tool, group.first);
    const Scalar far = field.value_at_clearance(field.voxel() + reach);
    Scalar nearest_far = std::numeric_limits<Scalar>::lowest();
    for (int i = group.first; i < group.last; ++i) {
      const Scalar value = values_[static_cast<std::size_t>(i)];
      if (value < far) {
        nearest_far = std::max(nearest_far, value);
        continue;
      }
      near_vertices_[static_cast<std::size_t>(near_count_)] = i;
      near_values_[static_cast<std::size_t>(near_count_)] = value;
      put(near_, near_count_++, tool.points()[i]);
    }
    if (nearest_far > std::numeric_limits<Scalar>::lowest())
      group.far_clearance = static_cast<double>(field.clearance(nearest_far) - reach);
  }

  /// The group of the place's vertex.
  [[nodiscard]] Group& group_of(int vertex) noexcept { return groups_[group_of_[static_cast<std::size_t>(vertex)]]; }

  template <PenetrationField Field>
  void touch(const Field& field, const Tool& tool, const Pose<Scalar>& X, double step, double turn) noexcept {
    found_count_ = 0;
    touching_ = 0;
    deepest_ = 0;
    for (Group& g : groups_) g.clearance = std::max(0.0, g.far_clearance - (step + turn * g.farthest));
    place_count_ = 0;
    for (int j = 0; j < near_count_; ++j) {
      const auto n = static_cast<std::size_t>(j);
      const Scalar reach = reach_of(tool, near_vertices_[n]);
      const Scalar clear = field.clearance(near_values_[n]);
      if (near_values_[n] > Scalar(0) || (Vertices::kGlide && clear < reach)) {
        place_vertices_[static_cast<std::size_t>(place_count_)] = near_vertices_[n];
        put(places_, place_count_++, near_[j]);
      } else {
        Group& group = group_of(near_vertices_[n]);
        group.clearance = std::min(group.clearance, static_cast<double>(clear - reach));
      }
    }
    if (place_count_ == 0) return;
    pad(places_, place_count_);
    gradients(field, X);
    if constexpr (Vertices::kGlide) glide(tool, X);
    collect(field, X);
  }

  [[nodiscard]] Scalar reach_of(const Tool& tool, int vertex) const noexcept {
    if constexpr (!Vertices::kGlide) return Scalar(0);
    return vertex < ball_ ? ball_reach_ * static_cast<Scalar>(tool.burr().tip_radius)
                          : ring_reach_ * static_cast<Scalar>(tool.burr().shaft_radius);
  }

  template <PenetrationField Field>
  void gradients(const Field& field, const Pose<Scalar>& X) noexcept {
    field.gradients(X, places_.x.data(), places_.y.data(), places_.z.data(), gradients_.x.data(), gradients_.y.data(),
                    gradients_.z.data(), padded_to_lane(place_count_));
  }

  /// Moves each place to where its patch points along the gradient, into the bone; at most to the patch's edge.
  void glide(const Tool& tool, const Pose<Scalar>& X) noexcept {
    const Mat3<Scalar> R_TG = X.linear().transpose();
    for (int j = 0; j < place_count_; ++j) {
      const int vertex = place_vertices_[static_cast<std::size_t>(j)];
      const bool ball = vertex < ball_;
      const Vec3<Scalar> from = -tool.inward()[vertex];
      Vec3<Scalar> to = R_TG * gradients_[j];
      if (!ball) to.z() = Scalar(0);
      const Scalar length = to.norm();
      if (!(length > Scalar(0))) continue;
      to /= length;
      const Scalar cosine = from.dot(to);
      const Scalar most = ball ? ball_cosine_ : ring_cosine_;
      if (cosine < most) {
        const Vec3<Scalar> beside = to - cosine * from;
        const Scalar b = beside.norm();
        if (!(b > Scalar(1e-6))) continue;
        to = most * from + (std::sqrt(Scalar(1) - most * most) / b) * beside;
      }
      const Scalar radius = static_cast<Scalar>(ball ? tool.burr().tip_radius : tool.burr().shaft_radius);
      Vec3<Scalar> p = radius * to;
      if (!ball) p.z() = places_.z[static_cast<std::size_t>(j)];
      put(places_, j, p);
    }
    pad(places_, place_count_);
  }

  /// The places that are in bone.
  template <PenetrationField Field>
  void collect(const Field& field, const Pose<Scalar>& X) noexcept {
    field.values(X, places_.x.data(), places_.y.data(), places_.z.data(), values_.data(), padded_to_lane(place_count_));
    const Scalar metres = field.metres();
    const Mat3<Scalar> R = X.linear();
    const Vec3<Scalar> t = X.translation();
    for (int j = 0; j < place_count_; ++j) {
      const Scalar value = values_[static_cast<std::size_t>(j)];
      if (!(value > Scalar(0))) {
        Group& group = group_of(place_vertices_[static_cast<std::size_t>(j)]);
        group.clearance = std::min(group.clearance, static_cast<double>(field.clearance(value)));
        continue;
      }
      const Vec3<Scalar> lever = R * places_[j];
      Vec3<Scalar> gradient = gradients_[j];
      if constexpr (Vertices::kGlide) gradient = field.smooth_gradient(t + lever);
      keep(j, value * metres, Vec3<Scalar>(-metres * gradient), lever);
    }
    touching_ = found_count_;
    if constexpr (Vertices::kGlide)
      for (int j = 0; j < place_count_; ++j) {
        const Scalar depth = metres * values_[static_cast<std::size_t>(j)];
        if (depth > Scalar(0) || depth < Scalar(-0.5) * field.voxel()) continue;
        keep(j, depth, Vec3<Scalar>(-metres * gradients_[j]), Vec3<Scalar>(R * places_[j]));
      }
  }

  void keep(int place, Scalar depth, const Vec3<Scalar>& out, const Vec3<Scalar>& lever) noexcept {
    VertexContact& c = found_[found_count_++];
    c.vertex = place_vertices_[static_cast<std::size_t>(place)];
    c.depth = static_cast<double>(depth);
    c.out = out.template cast<double>();
    c.lever = lever.template cast<double>();
    deepest_ = std::max(deepest_, c.depth);
  }

  int count_;
  int padded_;
  int ball_;
  Scalar ball_reach_ = Scalar(0);  // [rad] from a vertex to its patch's edge
  Scalar ring_reach_ = Scalar(0);
  Scalar ball_cosine_ = Scalar(1);
  Scalar ring_cosine_ = Scalar(1);
  double farthest_ = 0;
  std::vector<Group> groups_;
  std::vector<std::size_t> group_of_;  // each vertex
  double deepest_ = 0;
  std::size_t touching_ = 0;
  std::size_t found_count_ = 0;
  int near_count_ = 0;
  int place_count_ = 0;
  std::vector<Scalar> values_;
  std::vector<int> near_vertices_;  // that can touch near X_looked_
  std::vector<Scalar> near_values_;
  std::vector<int> place_vertices_;  // whose patch may be in bone
  PointArrays<Scalar> near_, places_, gradients_;
  std::vector<VertexContact> found_;
  Posed X_looked_ = Posed::Identity();
};

}  // namespace trephine
