// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/surface/patch_points.hpp>
#include <trephine/tool/neighbours.hpp>
#include <trephine/tool/surface_discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Integrates contact springs over the patches of vertices: turns each vertex's exit distance into its patch's spring.
///
/// It covers the vertices in bone, their neighbours, and vertices outside bone whose patch may reach into it. In a
/// group without a vertex in bone, only the vertex nearest to bone and its neighbours count, and only if bone lies at
/// the deepest reach of its patch. A tool without bone in its patches' reach therefore gets no force. The bone's
/// curvature follows from the change of its normals between neighbours.
///
/// Capacity is fixed at construction.
template <RealScalar Scalar>
class PatchQuadrature {
  // Confidence in the plane of a vertex outside bone, by its gradient over the group's steepest: 0 up to kMinSlope,
  // then linear to 1 at kMinSlope + kSlopeRange. Far down a blurred edge the gradient vanishes and its plane means
  // nothing.
  static constexpr auto kMinSlope = Scalar(0.2);
  static constexpr auto kSlopeRange = Scalar(0.4);
  // A density below a blurred edge deviates from a straight line nearly by the logarithm of its slope over this. The
  // number fits a Gaussian edge.
  static constexpr auto kEdgeLogarithm = Scalar(3);
  // The isosurface of a trilinear image lies inside the bone by h²/12 times the sum of the principal curvatures, on the
  // mean: h²/6R on a ball.
  static constexpr auto kImageShiftDivisor = Scalar(12);
  // Bone behind a vertex, in radii, from which on its spring has its full length. A vertex that enters bone from the
  // far side of a wall or ridge has a whole wall in front of it at once; its spring grows with the bone behind it
  // instead.
  static constexpr auto kFullCover = Scalar(0.25);

 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  explicit PatchQuadrature(const Tool& tool)
      : neighbours_(tool),
        points_(tool.periphery()),
        samples_(static_cast<std::size_t>(tool.periphery())),
        sample_of_(static_cast<std::size_t>(tool.periphery())),
        surfaces_(tool.groups().size()),
        springs_(static_cast<std::size_t>(tool.periphery())) {
    for (int i = 0; i < tool.periphery(); ++i) patches_.push_back(tool.patch(i));
  }

  /// Computes the patches' springs.
  /// - `vertices`: their positions in T: the tool's points, where no group is moved;
  /// - `values`: the field at all vertices;
  /// - `exit_distance`: for each vertex of the periphery, in: exit distance of the vertex [m], out: length of its
  /// spring;
  /// - `hits`: the vertices in bone, and `covers`: the bone behind each, as `RayExits` measures it [m];
  /// - `group_hit`: for each group, in: 1 if a vertex is in bone, out: 1 if a patch has a spring.
  template <ContactField Field>
  void integrate(const Field& field, const Tool& tool, const PointArrays<Scalar>& vertices, const Pose<Scalar>& X_GT,
                 std::span<const Scalar> values, std::span<const int> hits, std::span<const Scalar> covers,
                 std::span<Scalar> exit_distance, std::span<std::uint8_t> group_hit) noexcept {
    vertices_ = &vertices;
    std::fill(sample_of_.begin(), sample_of_.end(), kNoSample);
    std::fill(surfaces_.begin(), surfaces_.end(), GroupSurface{});
    points_.clear();
    for (std::size_t g = 0; g < tool.groups().size(); ++g)
      if (group_hit[g] == 0) request_nearest(tool, tool.groups()[g], values, exit_distance);
    fit_planes(field, tool, X_GT, values, exit_distance, 0);
    discard_out_of_reach(field, tool, X_GT);
    const int outside = points_.count();
    for (int j = 0; j < outside; ++j) request_neighbours(tool, exit_distance, points_.vertex(j));
    for (const int i : hits) {
      request(tool, exit_distance, i);
      request_neighbours(tool, exit_distance, i);
    }
    fit_planes(field, tool, X_GT, values, exit_distance, outside);
    for (int j = 0; j < points_.count(); ++j)
      accumulate(tool, points_.vertex(j), samples_[static_cast<std::size_t>(j)]);
    for (std::size_t g = 0; g < surfaces_.size(); ++g)
      if (surfaces_[g].steepest > Scalar(0)) fit_curvature(field, surfaces_[g], patch(tool.groups()[g].first));
    for (int j = 0; j < points_.count(); ++j) {
      const int i = points_.vertex(j);
      const Sample& sample = samples_[static_cast<std::size_t>(j)];
      const GroupSurface& surface = surfaces_[sample.group];
      Plane plane = sample.plane;
      if (!(surface.steepest > Scalar(0)) || (!sample.in_bone && !refine_plane(i, surface, sample, plane))) continue;
      plane.depth += surface.image_shift;
      PatchSpring<Scalar>& spring = springs_[static_cast<std::size_t>(i)];
      Scalar& distance = exit_distance[static_cast<std::size_t>(i)];
      spring = spring_of(tool, i, plane, surface.curvature);
      distance = spring.length = std::min(spring.length, distance + patch(i).reach());
      if (distance > Scalar(0)) group_hit[sample.group] = 1;
    }
    for (std::size_t j = 0; j < hits.size(); ++j) {
      const auto i = static_cast<std::size_t>(hits[j]);
      const Scalar full = kFullCover * patch(hits[j]).radius;
      if (covers[j] < full) springs_[i].length = exit_distance[i] *= covers[j] / full;
    }
  }

  /// Spring of vertex i in T axes, valid if `integrate` gave it a length > 0.
  [[nodiscard]] const PatchSpring<Scalar>& spring(int i) const noexcept {
    return springs_[static_cast<std::size_t>(i)];
  }

 private:
  // Values of sample_of_ for vertices without a sample.
  static constexpr int kNoSample = -1, kInDeepGroup = -2;

  // Local plane of the bone's surface, in T.
  struct Plane {
    Scalar depth = 0;                            // of the vertex below the plane [m]
    Vec3<Scalar> normal = Vec3<Scalar>::Zero();  // outward unit normal
  };

  // The bone's surface near a vertex, in T.
  struct Sample {
    std::size_t group = 0;
    bool has_surface = false;                  // by its density, a surface is within the reach of the vertex's patch
    bool in_bone = false;                      // the vertex is in bone
    Scalar value = 0, steepness = 0;           // field at the vertex, norm of the gradient at the sample point
    Plane plane;                               // valid if has_surface
    Vec3<Scalar> foot = Vec3<Scalar>::Zero();  // point of the plane: projection of the vertex, or its exit point
  };

  // Bone under a group, from all its samples. Curvature is the least-squares slope of the normals' change between
  // neighbours by their distance; index 0 is along the arc (on the ball any direction), 1 along the shaft.
  struct GroupSurface {
    Scalar steepest = 0;                          // largest gradient norm; 0: no surface
    std::array<Scalar, 2> change{}, distance2{};  // Σ Δnormal · Δfoot, Σ |Δfoot|²
    PatchCurvature<Scalar> curvature;
    Scalar image_shift = 0;  // depth of the trilinear isosurface inside the bone [m]
  };

  // Requests the vertex nearest to bone of a group that has none in bone, unless the density around it is constant.
  void request_nearest(const Tool& tool, const typename Tool::Group& group, std::span<const Scalar> values,
                       std::span<const Scalar> exit_distance) noexcept {
    if (values[static_cast<std::size_t>(group.centre)] >= Scalar(0)) {
      std::fill_n(sample_of_.begin() + group.first, group.count, kInDeepGroup);
      return;
    }
    int nearest = group.first;
    Scalar min = values[static_cast<std::size_t>(group.first)];
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Scalar value = values[static_cast<std::size_t>(i)];
      if (value > values[static_cast<std::size_t>(nearest)]) nearest = i;
      min = std::min(min, value);
    }
    const Scalar max = values[static_cast<std::size_t>(nearest)];
    if (max < Scalar(0) && max > min) request(tool, exit_distance, nearest);
  }

  // Adds a sample point for vertex i, once: the vertex, or its exit point if it is in bone.
  void request(const Tool& tool, std::span<const Scalar> exit_distance, int i) noexcept {
    if (sample_of_[static_cast<std::size_t>(i)] != kNoSample) return;
    sample_of_[static_cast<std::size_t>(i)] = points_.count();
    const Vec3<Scalar> p = (*vertices_)[i] + exit_distance[static_cast<std::size_t>(i)] * tool.inward()[i];
    points_.add(p, i);
  }
  void request_neighbours(const Tool& tool, std::span<const Scalar> exit_distance, int i) noexcept {
    for (const int j : neighbours_.of(i)) request(tool, exit_distance, j);
  }

  // Keeps the samples whose patch penetrates its plane, and whose deepest point along the normal is in bone.
  template <ContactField Field>
  void discard_out_of_reach(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT) noexcept {
    int kept = 0;
    for (int j = 0; j < points_.count(); ++j) {
      const int i = points_.vertex(j);
      const Sample& sample = samples_[static_cast<std::size_t>(j)];
      const auto is_bone = [&](const Vec3<Scalar>& p_T) { return field.value(X_GT * p_T) >= Scalar(0); };
      const bool reaches = sample.has_surface && spring_of(tool, i, sample.plane, {}).length > Scalar(0) &&
                           is_bone((*vertices_)[i] - patch(i).reach() * sample.plane.normal);
      sample_of_[static_cast<std::size_t>(i)] = reaches ? kept : kNoSample;
      if (!reaches) continue;
      points_.move(j, kept);
      samples_[static_cast<std::size_t>(kept++)] = sample;
    }
    points_.truncate(kept);
  }

  // Fits planes at points from `from` on: the normal from the gradient, the depth from the exit distance of a vertex in
  // bone or from the value of a vertex outside.
  template <ContactField Field>
  void fit_planes(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT, std::span<const Scalar> values,
                  std::span<const Scalar> exit_distance, int from) noexcept {
    if (from == points_.count()) return;
    points_.compute_gradients(field, X_GT, from);
    const Mat3<Scalar> to_T = -X_GT.linear().transpose();
    for (int j = from; j < points_.count(); ++j) {
      const int i = points_.vertex(j);
      Sample& sample = samples_[static_cast<std::size_t>(j)];
      const Vec3<Scalar> slope = points_.gradient(j);
      sample.group = tool.group_of(i);
      sample.value = values[static_cast<std::size_t>(i)];
      sample.in_bone = sample.value >= Scalar(0);
      sample.steepness = slope.norm();
      sample.has_surface =
          sample.steepness > Scalar(0) && (sample.in_bone || -sample.value < patch(i).reach() * sample.steepness);
      if (!sample.has_surface) continue;
      Plane& plane = sample.plane;
      plane.normal = to_T * ((Scalar(1) / sample.steepness) * slope);
      const Scalar distance = exit_distance[static_cast<std::size_t>(i)];
      plane.depth = sample.in_bone ? distance * plane.normal.dot(tool.inward()[i]) : sample.value / sample.steepness;
      sample.foot = (*vertices_)[i];
      sample.foot +=
          sample.in_bone ? Vec3<Scalar>(distance * tool.inward()[i]) : Vec3<Scalar>(plane.depth * plane.normal);
    }
  }

  // Adds a sample to its group's surface, each pair of neighbours once. Feet on slanted bone are farther apart along
  // the slant. On the ball, pairs are therefore projected along the inward direction: they then spread evenly to all
  // sides, and their mean is that of both principal curvatures.
  void accumulate(const Tool& tool, int i, const Sample& sample) noexcept {
    if (!sample.has_surface) return;
    surfaces_[sample.group].steepest = std::max(surfaces_[sample.group].steepest, sample.steepness);
    for (const int k : neighbours_.of(i)) {
      if (k < i) continue;
      const Sample* other = find_sample(k);
      if (other == nullptr) continue;
      Vec3<Scalar> offset = other->foot - sample.foot;
      if (patch(i).disc > Scalar(0)) offset -= offset.dot(tool.inward()[i]) * tool.inward()[i];
      const Scalar change = (other->plane.normal - sample.plane.normal).dot(offset), distance2 = offset.squaredNorm();
      const std::size_t axis = other->group == sample.group ? 0 : 1;
      surfaces_[sample.group].change[axis] += change;
      surfaces_[sample.group].distance2[axis] += distance2;
      if (axis == 0) continue;
      surfaces_[other->group].change[axis] += change;
      surfaces_[other->group].distance2[axis] += distance2;
    }
  }

  // Sample of vertex i if it has one with a surface, else nullptr.
  [[nodiscard]] const Sample* find_sample(int i) const noexcept {
    const int j = sample_of_[static_cast<std::size_t>(i)];
    return j >= 0 && samples_[static_cast<std::size_t>(j)].has_surface ? &samples_[static_cast<std::size_t>(j)]
                                                                       : nullptr;
  }

  [[nodiscard]] const Patch<Scalar>& patch(int i) const noexcept { return patches_[static_cast<std::size_t>(i)]; }

  [[nodiscard]] PatchSpring<Scalar> spring_of(const Tool& tool, int i, const Plane& plane,
                                              const PatchCurvature<Scalar>& curvature) const noexcept {
    return patch(i).spring(plane.depth, plane.normal, tool.inward()[i], tool.along(i), curvature);
  }

  // Confidence in a sample's plane: 1 at the surface and in bone, 0 where the density is flat.
  [[nodiscard]] static Scalar confidence(const Sample& sample, Scalar steepest) noexcept {
    if (!sample.has_surface || sample.in_bone) return sample.has_surface ? Scalar(1) : Scalar(0);
    return std::clamp((sample.steepness / steepest - kMinSlope) / kSlopeRange, Scalar(0), Scalar(1));
  }

  // Fits a group's curvature, limited to one over its patch's reach, and the shift of a trilinear isosurface.
  template <ContactField Field>
  static void fit_curvature(const Field& field, GroupSurface& surface, const Patch<Scalar>& patch) noexcept {
    const Scalar max = Scalar(1) / patch.reach();
    const auto curvature = [&](std::size_t axis) {
      const Scalar distance2 = surface.distance2[axis];
      return distance2 > Scalar(0) ? std::clamp(surface.change[axis] / distance2, -max, max) : Scalar(0);
    };
    surface.curvature = {curvature(0), curvature(1)};
    if constexpr (kTrilinear<Field>) {
      const Scalar sum =
          surface.curvature.arc + (patch.disc > Scalar(0) ? surface.curvature.arc : surface.curvature.length);
      surface.image_shift = field.voxel() * field.voxel() / kImageShiftDivisor * sum;
    }
  }

  // Refines the plane of a vertex outside bone: corrects its depth for the blurred edge, and blends it with the planes
  // of its neighbours by confidence. Returns false if no surface is near.
  [[nodiscard]] bool refine_plane(int i, const GroupSurface& surface, const Sample& sample,
                                  Plane& plane) const noexcept {
    const Scalar steepest = surface.steepest;
    const Scalar own = confidence(sample, steepest);
    if (own > Scalar(0))
      plane.depth = sample.value / steepest * (Scalar(1) + std::log(steepest / sample.steepness) / kEdgeLogarithm);
    if (own >= Scalar(1)) return true;
    Scalar sum = Scalar(0), depth = Scalar(0);
    Vec3<Scalar> normal = Vec3<Scalar>::Zero();
    for (const int k : neighbours_.of(i)) {
      const Sample* other = find_sample(k);
      const Scalar weight = other != nullptr ? confidence(*other, steepest) : Scalar(0);
      if (!(weight > Scalar(0))) continue;
      // The neighbour's plane, bent by the curvature, at this vertex.
      const Scalar curvature = other->group == sample.group ? surface.curvature.arc : surface.curvature.length;
      const Vec3<Scalar> offset = (*vertices_)[i] - other->foot;
      const Vec3<Scalar>& n = other->plane.normal;
      const Scalar height = offset.dot(n);
      const Vec3<Scalar> tangential = offset - height * n;
      sum += weight;
      depth -= weight * (height + Scalar(0.5) * curvature * tangential.squaredNorm());
      normal += weight * (n + curvature * tangential);
    }
    if (!(sum > Scalar(0))) return sample.has_surface;
    // Beyond an edge the neighbours' bone ends: the depth is at most that of a straight line down to this density.
    const Scalar max = sample.value / steepest;
    plane.depth = std::min(own * plane.depth + (Scalar(1) - own) * depth / sum, max);
    plane.normal = (own * plane.normal + (Scalar(1) - own) / sum * normal).normalized();
    return true;
  }

  PatchNeighbours neighbours_;
  PatchPoints<Scalar> points_;
  const PointArrays<Scalar>* vertices_ = nullptr;  // during `integrate`
  std::vector<Sample> samples_;                    // of each point
  std::vector<int> sample_of_;                     // of each vertex: index of its sample, or kNoSample, kInDeepGroup
  std::vector<GroupSurface> surfaces_;             // of each group
  std::vector<Patch<Scalar>> patches_;             // of each vertex
  std::vector<PatchSpring<Scalar>> springs_;       // of each vertex
};

}  // namespace trephine
