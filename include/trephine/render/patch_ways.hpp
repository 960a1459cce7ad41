// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/patch_points.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/tool/neighbours.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine {

/// Makes of the ways out of vertices their means over the patches that they stand for: of the vertices in bone and of
/// those whose patch may reach into it, which are the neighbours of the former and, in a group without any, the one
/// that is nearest to bone with its neighbours. Capacity is fixed at construction.
template <RealScalar Scalar>
class PatchWays {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  explicit PatchWays(const Tool& tool)
      : neighbours_(tool), points_(tool.periphery()), done_(static_cast<std::size_t>(tool.periphery())) {}

  /// `values`: the field's at all vertices; `way`: of each vertex of the periphery, taken and given; `hits`: those in
  /// bone.
  template <ContactField Field>
  void spread(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT, std::span<const Scalar> values,
              std::span<const int> hits, std::span<Scalar> way) noexcept {
    std::fill(done_.begin(), done_.end(), false);
    points_.clear();
    for (const auto& group : tool.groups()) {
      int nearest = group.first;
      bool touches = values[static_cast<std::size_t>(group.centre)] >= Scalar(0);
      if (touches) std::fill_n(done_.begin() + group.first, group.count, true);
      for (int i = group.first; i < group.first + group.count; ++i) {
        touches = touches || values[static_cast<std::size_t>(i)] >= Scalar(0);
        if (values[static_cast<std::size_t>(i)] > values[static_cast<std::size_t>(nearest)]) nearest = i;
      }
      if (!touches) want(tool, way, nearest);
    }
    const int alone = points_.count();
    measure(field, tool, X_GT, values, way, 0, alone);
    for (int j = 0; j < alone; ++j)
      if (way[static_cast<std::size_t>(points_.vertex(j))] > Scalar(0)) want_neighbours(tool, way, points_.vertex(j));
    for (const int i : hits) {
      want(tool, way, i);
      want_neighbours(tool, way, i);
    }
    measure(field, tool, X_GT, values, way, alone, points_.count());
  }

 private:
  void want(const Tool& tool, std::span<const Scalar> way, int i) noexcept {
    if (done_[static_cast<std::size_t>(i)]) return;
    done_[static_cast<std::size_t>(i)] = true;
    // Of a vertex in bone the surface is taken at the end of its way out.
    const Vec3<Scalar> p = tool.points()[i] + way[static_cast<std::size_t>(i)] * tool.inward()[i];
    points_.add(p, i);
  }
  void want_neighbours(const Tool& tool, std::span<const Scalar> way, int i) noexcept {
    for (const int j : neighbours_.of(i)) want(tool, way, j);
  }

  // The patches of points from … to: the bone's plane at each is told by the gradient there, and by the way out of a
  // vertex in bone or the value of one outside.
  template <ContactField Field>
  void measure(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT, std::span<const Scalar> values,
               std::span<Scalar> ways, int from, int to) noexcept {
    if (from == to) return;
    points_.gradients(field, X_GT, from, to);
    const Vec3<Scalar> axis = X_GT.linear().col(2);
    for (int j = from; j < to; ++j) {
      const int i = points_.vertex(j);
      const Vec3<Scalar> slope = points_.gradient(j);
      const Scalar steepness = slope.norm();
      Scalar& way = ways[static_cast<std::size_t>(i)];
      const Scalar value = values[static_cast<std::size_t>(i)];
      const Patch<Scalar> patch = tool.patch(i);
      const bool inside = value >= Scalar(0);
      if (!inside && !(-value < patch.reach() * steepness)) continue;
      if (!(steepness > Scalar(0))) continue;
      const Vec3<Scalar> n = -slope / steepness;
      const Vec3<Scalar> d = X_GT.linear() * tool.inward()[i];
      const Scalar depth = inside ? way * n.dot(d) : value / steepness;
      way = std::min(patch.mean_way(depth, n, d, axis), way + patch.reach());
    }
  }

  PatchNeighbours neighbours_;
  PatchPoints<Scalar> points_;
  std::vector<std::uint8_t> done_;  // of each vertex: looked at, or of a group whose centre is in bone
};

}  // namespace trephine
