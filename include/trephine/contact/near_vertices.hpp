// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace trephine {

/// A contact field whose values say how deep a point is: `metres()` per unit of value; `clearance(value)` [m], below
/// which no bone is near, and its inverse; depth and gradient that do not show the cells; and a stamp that changes when
/// bone may have come nearer (VoxelGrid). A DepthField tells distances; a DensityField depths of a kind and no
/// clearance.
// clang-format off
template <class F>
concept PenetrationField = ContactField<F> && requires(const F& f, typename F::Scalar v, const Vec3<typename F::Scalar>& p,
                                                       Vec3<typename F::Scalar>& g, Mat3<typename F::Scalar>& H) {
  { f.metres() } noexcept -> std::same_as<typename F::Scalar>;
  { f.clearance(v) } noexcept -> std::same_as<typename F::Scalar>;
  { f.value_at_clearance(v) } noexcept -> std::same_as<typename F::Scalar>;
  { f.smooth_gradient(p) } noexcept -> std::same_as<Vec3<typename F::Scalar>>;
  { f.smooth(p, g) } noexcept -> std::same_as<typename F::Scalar>;
  { f.smooth(p, g, H) } noexcept -> std::same_as<typename F::Scalar>;
  { f.rise_stamp() } noexcept -> std::same_as<std::uint64_t>;
};
// clang-format on

/// The vertices of a tool that can touch near where it is. Tool and bone move little between two looks, and bone that
/// is cut only recedes: vertices that cannot have come near since they were last sampled are passed over, the ball's
/// and each slice's apart. Allocates at construction alone.
///
/// A ball is the same whichever way it is turned, its vertices are not: unless `ball_turns` theirs keep their
/// directions in G, and no turning of the tool changes what the ball touches.
template <RealScalar Scalar>
class NearVertices {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  /// Vertices first … last − 1: of the ball or of a slice.
  struct Group {
    int first = 0;
    int last = 0;
    Scalar reach = Scalar(0);   // what counts as a vertex goes that far round it [m]
    double lever = 0;           // a turn of the tool moves none farther than by it [m]
    double far_clearance = -1;  // of those that are not near, at X_looked_ [m]; below 0: not known
    bool passed_over = false;   // at X_looked_: the clearance is what is left of one that was seen before
    bool closer = false;        // was passed over there first
  };

  /// `ball_reach`, `ring_reach` [m]: how far round it a vertex of the ball, of a slice may touch.
  NearVertices(const Tool& tool, bool ball_turns, Scalar ball_reach, Scalar ring_reach)
      : count_(tool.periphery()),
        resting_(ball_turns ? 0 : tool.groups()[0].count),
        standing_(tool.points()),
        values_(static_cast<std::size_t>(tool.padded())) {
    groups_.resize(tool.groups().size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      groups_[g].first = tool.groups()[g].first;
      groups_[g].last = tool.groups()[g].first + tool.groups()[g].count;
      groups_[g].reach = g == 0 ? ball_reach : ring_reach;
      for (int i = groups_[g].first; i < groups_[g].last; ++i) {
        if (i >= resting_) groups_[g].lever = std::max(groups_[g].lever, static_cast<double>(tool.points()[i].norm()));
        group_of_.push_back(g);
      }
    }
    const auto padded = static_cast<std::size_t>(padded_to_lane(count_));
    for (auto* v : {&points_.x, &points_.y, &points_.z}) v->resize(padded);
    near_values_.resize(padded);
    is_near_.resize(static_cast<std::size_t>(count_));
    vertices_.resize(padded);
  }

  [[nodiscard]] int count() const noexcept { return near_count_; }
  /// Of the j-th: its number, where it is in T, and the field's value there.
  [[nodiscard]] int vertex(int j) const noexcept { return vertices_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] Vec3<Scalar> point(int j) const noexcept { return points_[j]; }
  [[nodiscard]] Scalar value(int j) const noexcept { return near_values_[static_cast<std::size_t>(j)]; }

  /// Where any vertex stands in T.
  [[nodiscard]] Vec3<Scalar> standing(int vertex) const noexcept { return standing_[vertex]; }
  /// Whether a turn of the tool moves it.
  [[nodiscard]] bool turns(int vertex) const noexcept { return vertex >= resting_; }
  /// Where they were looked for.
  [[nodiscard]] const Posed& pose() const noexcept { return X_looked_; }
  [[nodiscard]] std::span<const Group> groups() const noexcept { return groups_; }
  [[nodiscard]] std::size_t group_of(int vertex) const noexcept { return group_of_[static_cast<std::size_t>(vertex)]; }

  /// Finds and samples them at pose X_GT.
  template <PenetrationField Field>
  void look(const Field& field, const Tool& tool, const Posed& X_GT) noexcept {
    const double step = (X_GT.translation() - X_looked_.translation()).norm();
    // 2 sin(θ/2): the chord that a point a metre off moves along.
    const double turn = (X_GT.linear() - X_looked_.linear()).norm() / std::numbers::sqrt2;
    turned_ = resting_ > 0 && (turned_ || turn > 0);
    X_looked_ = X_GT;
    if (std::exchange(stamp_, field.rise_stamp()) != field.rise_stamp()) forget();
    bool anew = false;
    for (Group& g : groups_) {
      g.far_clearance -= step + turn * g.lever;
      // Half a voxel before it must, so that what is left does not shorten a step.
      if (!(g.far_clearance >= static_cast<double>(field.voxel()) / 2)) g.far_clearance = -1;
      g.passed_over = g.far_clearance >= 0;
      g.closer = false;
      anew = anew || !g.passed_over;
    }
    sample(field, tool, anew);
  }

  /// Looks again, at the same pose, at groups that were passed over and whose far vertices are not known to be as clear
  /// as `wanted(group)` [m]. Whether there was one.
  template <PenetrationField Field, class Wanted>
  bool look_closer(const Field& field, const Tool& tool, Wanted&& wanted) noexcept {
    bool anew = false;
    for (Group& g : groups_) {
      if (!g.passed_over || g.far_clearance >= wanted(g)) continue;
      g.far_clearance = -1;
      g.passed_over = false;
      g.closer = anew = true;
    }
    if (anew) sample(field, tool, anew);
    return anew;
  }

  /// Looks at every vertex next time.
  void forget() noexcept {
    for (Group& g : groups_) g.far_clearance = -1;
  }

 private:
  /// The near vertices at X_looked_, and with `anew` before that which they are.
  template <PenetrationField Field>
  void sample(const Field& field, const Tool& tool, bool anew) noexcept {
    const Pose<Scalar> X = X_looked_.template cast<Scalar>();
    if (std::exchange(turned_, false)) let_rest(tool, X);
    if (anew) look_again(field, X);
    if (near_count_ > 0)
      field.values(X, points_.x.data(), points_.y.data(), points_.z.data(), near_values_.data(),
                   padded_to_lane(near_count_));
  }

  /// Turns back in T what keeps its direction in G.
  void let_rest(const Tool& tool, const Pose<Scalar>& X) noexcept {
    const Mat3<Scalar> A = X.linear().transpose();
    const auto& p = tool.points();
    for (std::size_t i = 0; i < static_cast<std::size_t>(resting_); ++i) {
      standing_.x[i] = A(0, 0) * p.x[i] + A(0, 1) * p.y[i] + A(0, 2) * p.z[i];
      standing_.y[i] = A(1, 0) * p.x[i] + A(1, 1) * p.y[i] + A(1, 2) * p.z[i];
      standing_.z[i] = A(2, 0) * p.x[i] + A(2, 1) * p.y[i] + A(2, 2) * p.z[i];
    }
    for (int j = 0; j < near_count_ && vertex(j) < resting_; ++j) points_.put(j, standing_[vertex(j)]);
  }

  /// Samples the groups that may have come near, runs of them at once, and tells their near vertices from far ones.
  template <PenetrationField Field>
  void look_again(const Field& field, const Pose<Scalar>& X) noexcept {
    const auto& p = standing_;
    for (std::size_t g = 0; g < groups_.size();) {
      std::size_t end = g;
      while (end < groups_.size() && groups_[end].far_clearance < 0) ++end;
      if (end > g) {
        const int n = padded_to_lane(groups_[end - 1].last - groups_[g].first);
        const int first = std::min(groups_[g].first, p.size() - n);
        field.values(X, p.x.data() + first, p.y.data() + first, p.z.data() + first, values_.data() + first, n);
      }
      for (; g < end; ++g) sort_out(field, groups_[g]);
      if (g < groups_.size()) ++g;
    }
    near_count_ = 0;
    for (int i = 0; i < count_; ++i) {
      if (is_near_[static_cast<std::size_t>(i)] == 0) continue;
      vertices_[static_cast<std::size_t>(near_count_)] = i;
      points_.put(near_count_++, standing_[i]);
    }
    points_.fill_lane(near_count_);
  }

  /// Which of a group's vertices can touch within a voxel from here.
  template <PenetrationField Field>
  void sort_out(const Field& field, Group& group) noexcept {
    group.far_clearance = std::numeric_limits<double>::infinity();
    if (group.first == group.last) return;
    const Scalar reach = group.reach;
    const Scalar far = field.value_at_clearance(field.voxel() + reach);
    Scalar nearest_far = std::numeric_limits<Scalar>::lowest();
    for (auto i = static_cast<std::size_t>(group.first); i < static_cast<std::size_t>(group.last); ++i) {
      is_near_[i] = values_[i] < far ? 0 : 1;
      if (is_near_[i] == 0) nearest_far = std::max(nearest_far, values_[i]);
    }
    if (nearest_far > std::numeric_limits<Scalar>::lowest())
      group.far_clearance = static_cast<double>(field.clearance(nearest_far) - reach);
  }

  int count_;
  int resting_;                   // so many vertices, the first, keep their directions in G
  PointArrays<Scalar> standing_;  // all vertices in T
  bool turned_ = true;            // since standing_ was made
  std::vector<Group> groups_;
  std::vector<std::size_t> group_of_;  // each vertex
  int near_count_ = 0;
  std::vector<Scalar> values_;
  std::vector<std::uint8_t> is_near_;  // each vertex: can touch near X_looked_
  std::vector<int> vertices_;
  std::vector<Scalar> near_values_;
  PointArrays<Scalar> points_;
  Posed X_looked_ = Posed::Identity();
  std::uint64_t stamp_ = 0;  // of the bone that was looked at
};

}  // namespace trephine
