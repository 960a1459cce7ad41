// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/surface/patch_points.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/tool/neighbours.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine {

/// Makes of the ways out of vertices what the patches pull that they stand for: of the vertices in bone and of those
/// whose patch may reach into it, which are the neighbours of the former and, in a group without any, the one that is
/// nearest to bone with its neighbours, if bone is where its patch reaches deepest: so a tool in whose patches' reach
/// no bone is gets nothing. How bone bends is told by how its normals turn from neighbour to neighbour. Capacity is
/// fixed at construction.
template <RealScalar Scalar>
class PatchQuadrature {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  explicit PatchQuadrature(const Tool& tool)
      : neighbours_(tool),
        points_(tool.periphery()),
        places_(static_cast<std::size_t>(tool.periphery())),
        at_(static_cast<std::size_t>(tool.periphery())),
        surfaces_(tool.groups().size()),
        pulls_(static_cast<std::size_t>(tool.periphery())) {
    for (int i = 0; i < tool.periphery(); ++i) patches_.push_back(tool.patch(i));
  }

  /// `values`: the field's at all vertices; `way`: of each vertex of the periphery, taken and given; `hits`: those in
  /// bone; `touches`: of each group, taken as 1 where it has a hit, given as 1 where it has a way.
  template <ContactField Field>
  void spread(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT, std::span<const Scalar> values,
              std::span<const int> hits, std::span<Scalar> way, std::span<std::uint8_t> touches) noexcept {
    std::fill(at_.begin(), at_.end(), kNotAsked);
    std::fill(surfaces_.begin(), surfaces_.end(), Surface{});
    points_.clear();
    for (std::size_t g = 0; g < tool.groups().size(); ++g)
      if (touches[g] == 0) want_nearest(tool, tool.groups()[g], values, way);
    find_surface(field, tool, X_GT, values, way, 0, points_.count());
    keep_those_that_reach(field, tool, X_GT);
    const int alone = points_.count();
    for (int j = 0; j < alone; ++j) want_neighbours(tool, way, points_.vertex(j));
    for (const int i : hits) {
      want(tool, way, i);
      want_neighbours(tool, way, i);
    }
    find_surface(field, tool, X_GT, values, way, alone, points_.count());
    for (int j = 0; j < points_.count(); ++j) see(tool, points_.vertex(j), places_[static_cast<std::size_t>(j)]);
    for (std::size_t g = 0; g < surfaces_.size(); ++g)
      if (surfaces_[g].steepest > Scalar(0)) settle_bend(field, surfaces_[g], patch(tool.groups()[g].first));
    for (int j = 0; j < points_.count(); ++j) {
      const int i = points_.vertex(j);
      Place& place = places_[static_cast<std::size_t>(j)];
      const Surface& surface = surfaces_[place.group];
      Plane plane = place.plane;
      if (!(surface.steepest > Scalar(0)) || (!place.inside && !settle(tool, i, surface, place, plane))) continue;
      plane.depth += surface.image_shift;
      PatchPull<Scalar>& p = pulls_[static_cast<std::size_t>(i)];
      Scalar& mine = way[static_cast<std::size_t>(i)];
      p = pull(tool, i, plane, surface.bend);
      mine = p.way = std::min(p.way, mine + patch(i).reach());
      if (mine > Scalar(0)) touches[place.group] = 1;
    }
  }

  /// Of a vertex whose way `spread` gave as more than 0, in T.
  [[nodiscard]] const PatchPull<Scalar>& pull(int i) const noexcept { return pulls_[static_cast<std::size_t>(i)]; }

 private:
  static constexpr int kNotAsked = -1, kOfDeepGroup = -2;

  // Of bone under a vertex, in T.
  struct Plane {
    Scalar depth = 0;  // of the vertex below it [m]
    Vec3<Scalar> normal = Vec3<Scalar>::Zero();
  };

  // The bone's surface beside a vertex, in T.
  struct Place {
    std::size_t group = 0;
    bool near = false;    // the vertex' density tells of a surface that its patch may reach
    bool inside = false;  // the vertex is in bone
    Scalar value = 0, steepness = 0;
    Plane plane;
    Vec3<Scalar> foot = Vec3<Scalar>::Zero();
  };

  // What a group's places tell together of the bone. Its bend: the curvatures with which normals turn best from vertex
  // to neighbour, in the least squares' sense; along the arc (on the ball all ways) and along the shaft.
  struct Surface {
    Scalar steepest = 0;
    std::array<Scalar, 2> turned{}, apart{};
    Bend<Scalar> bend;
    Scalar image_shift = 0;  // how far inside the bone its image lies [m]
  };

  // Of a group without a vertex in bone the nearest, unless it is in flat air.
  void want_nearest(const Tool& tool, const typename Tool::Group& group, std::span<const Scalar> values,
                    std::span<const Scalar> way) noexcept {
    if (values[static_cast<std::size_t>(group.centre)] >= Scalar(0)) {
      std::fill_n(at_.begin() + group.first, group.count, kOfDeepGroup);
      return;
    }
    int nearest = group.first;
    Scalar least = values[static_cast<std::size_t>(group.first)];
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Scalar value = values[static_cast<std::size_t>(i)];
      if (value > values[static_cast<std::size_t>(nearest)]) nearest = i;
      least = std::min(least, value);
    }
    const Scalar most = values[static_cast<std::size_t>(nearest)];
    if (most < Scalar(0) && most > least) want(tool, way, nearest);
  }

  void want(const Tool& tool, std::span<const Scalar> way, int i) noexcept {
    if (at_[static_cast<std::size_t>(i)] != kNotAsked) return;
    at_[static_cast<std::size_t>(i)] = points_.count();
    // Of a vertex in bone the surface is taken at the end of its way out.
    const Vec3<Scalar> p = tool.points()[i] + way[static_cast<std::size_t>(i)] * tool.inward()[i];
    points_.add(p, i);
  }
  void want_neighbours(const Tool& tool, std::span<const Scalar> way, int i) noexcept {
    for (const int j : neighbours_.of(i)) want(tool, way, j);
  }

  // Of the points so far those whose patch is in bone, were it flat there, and bone is where the patch reaches deepest.
  template <ContactField Field>
  void keep_those_that_reach(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT) noexcept {
    int kept = 0;
    for (int j = 0; j < points_.count(); ++j) {
      const int i = points_.vertex(j);
      const Place& place = places_[static_cast<std::size_t>(j)];
      const auto is_bone = [&](const Vec3<Scalar>& p_T) { return field.value(X_GT * p_T) >= Scalar(0); };
      const bool reaches = place.near && pull(tool, i, place.plane, {}).way > Scalar(0) &&
                           is_bone(tool.points()[i] - patch(i).reach() * place.plane.normal);
      at_[static_cast<std::size_t>(i)] = reaches ? kept : kNotAsked;
      if (!reaches) continue;
      points_.move(j, kept);
      places_[static_cast<std::size_t>(kept++)] = place;
    }
    points_.keep(kept);
  }

  // At points from … to: the plane is told by the gradient there, and by the way out of a vertex in bone or the value
  // of one outside.
  template <ContactField Field>
  void find_surface(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT, std::span<const Scalar> values,
                    std::span<const Scalar> ways, int from, int to) noexcept {
    if (from == to) return;
    points_.gradients(field, X_GT, from, to);
    const Mat3<Scalar> to_T = -X_GT.linear().transpose();
    for (int j = from; j < to; ++j) {
      const int i = points_.vertex(j);
      Place& place = places_[static_cast<std::size_t>(j)];
      const Vec3<Scalar> slope = points_.gradient(j);
      place.group = tool.group_of(i);
      place.value = values[static_cast<std::size_t>(i)];
      place.inside = place.value >= Scalar(0);
      place.steepness = slope.norm();
      place.near = place.steepness > Scalar(0) && (place.inside || -place.value < patch(i).reach() * place.steepness);
      if (!place.near) continue;
      Plane& plane = place.plane;
      plane.normal = to_T * ((Scalar(1) / place.steepness) * slope);
      const Scalar way = ways[static_cast<std::size_t>(i)];
      plane.depth = place.inside ? way * plane.normal.dot(tool.inward()[i]) : place.value / place.steepness;
      place.foot = tool.points()[i];
      place.foot += place.inside ? Vec3<Scalar>(way * tool.inward()[i]) : Vec3<Scalar>(plane.depth * plane.normal);
    }
  }

  // What a place says of its group's surface; of its bend each pair of neighbours once. On the ball pairs are seen
  // along the way in, from where they lie to all sides alike, so that their mean is that of both principal curvatures:
  // on bone that slants they stand farther apart along the slant.
  void see(const Tool& tool, int i, const Place& here) noexcept {
    if (!here.near) return;
    surfaces_[here.group].steepest = std::max(surfaces_[here.group].steepest, here.steepness);
    for (const int k : neighbours_.of(i)) {
      if (k < i) continue;
      const Place* there = surface_at(k);
      if (there == nullptr) continue;
      Vec3<Scalar> way = there->foot - here.foot;
      if (patch(i).disc > Scalar(0)) way -= way.dot(tool.inward()[i]) * tool.inward()[i];
      const Scalar turned = (there->plane.normal - here.plane.normal).dot(way), apart = way.squaredNorm();
      const std::size_t along = there->group == here.group ? 0 : 1;
      surfaces_[here.group].turned[along] += turned;
      surfaces_[here.group].apart[along] += apart;
      if (along == 0) continue;
      surfaces_[there->group].turned[along] += turned;
      surfaces_[there->group].apart[along] += apart;
    }
  }

  [[nodiscard]] const Place* surface_at(int i) const noexcept {
    const int at = at_[static_cast<std::size_t>(i)];
    return at >= 0 && places_[static_cast<std::size_t>(at)].near ? &places_[static_cast<std::size_t>(at)] : nullptr;
  }

  [[nodiscard]] const Patch<Scalar>& patch(int i) const noexcept { return patches_[static_cast<std::size_t>(i)]; }

  [[nodiscard]] PatchPull<Scalar> pull(const Tool& tool, int i, const Plane& plane,
                                       const Bend<Scalar>& bend) const noexcept {
    return patch(i).pull(plane.depth, plane.normal, tool.inward()[i], Vec3<Scalar>::UnitZ(), bend);
  }

  // How much a place's density tells of the surface: 1 at its edge, 0 where the density is flat.
  [[nodiscard]] static Scalar trust(const Place& place, Scalar steepest) noexcept {
    if (!place.near || place.inside) return place.near ? Scalar(1) : Scalar(0);
    return std::clamp((place.steepness / steepest - Scalar(0.2)) / Scalar(0.4), Scalar(0), Scalar(1));
  }

  // No bend is taken for sharper than a patch. A trilinear image lies inside the bone by h²/12 of the sum of its
  // principal curvatures on the mean, which is h²/6R for a ball.
  template <ContactField Field>
  static void settle_bend(const Field& field, Surface& surface, const Patch<Scalar>& patch) noexcept {
    const Scalar most = Scalar(1) / patch.reach();
    const auto curvature = [&](std::size_t along) {
      const Scalar apart = surface.apart[along];
      return apart > Scalar(0) ? std::clamp(surface.turned[along] / apart, -most, most) : Scalar(0);
    };
    surface.bend = {curvature(0), curvature(1)};
    if constexpr (kTrilinear<Field>) {
      const Scalar sum = surface.bend.arc + (patch.disc > Scalar(0) ? surface.bend.arc : surface.bend.length);
      surface.image_shift = field.voxel() * field.voxel() / Scalar(12) * sum;
    }
  }

  // The plane of a vertex outside. Far down a blurred edge density falls short of a straight line (of a Gaussian
  // edge by nearly the logarithm below), and is flat at last: what it cannot tell the neighbours' planes do. False: no
  // surface is known there.
  [[nodiscard]] bool settle(const Tool& tool, int i, const Surface& surface, const Place& place,
                            Plane& plane) const noexcept {
    const Scalar steepest = surface.steepest;
    const Scalar own = trust(place, steepest);
    if (own > Scalar(0))
      plane.depth = place.value / steepest * (Scalar(1) + std::log(steepest / place.steepness) / Scalar(3));
    if (own >= Scalar(1)) return true;
    Scalar sum = Scalar(0), depth = Scalar(0);
    Vec3<Scalar> normal = Vec3<Scalar>::Zero();
    for (const int k : neighbours_.of(i)) {
      const Place* there = surface_at(k);
      const Scalar weight = there != nullptr ? trust(*there, steepest) : Scalar(0);
      if (!(weight > Scalar(0))) continue;
      const Scalar bent = there->group == place.group ? surface.bend.arc : surface.bend.length;
      const Vec3<Scalar> way = tool.points()[i] - there->foot;
      const Vec3<Scalar>& n = there->plane.normal;
      const Scalar height = way.dot(n);
      const Vec3<Scalar> aside = way - height * n;
      sum += weight;
      depth -= weight * (height + Scalar(0.5) * bent * aside.squaredNorm());
      normal += weight * (n + bent * aside);
    }
    if (!(sum > Scalar(0))) return place.near;
    // Beyond an edge the neighbours' bone has ended: no nearer than a straight line down to this density.
    const Scalar least = place.value / steepest;
    plane.depth = std::min(own * plane.depth + (Scalar(1) - own) * depth / sum, least);
    plane.normal = (own * plane.normal + (Scalar(1) - own) / sum * normal).normalized();
    return true;
  }

  PatchNeighbours neighbours_;
  PatchPoints<Scalar> points_;
  std::vector<Place> places_;             // of each point
  std::vector<int> at_;                   // of each vertex: its point, or why it has none
  std::vector<Surface> surfaces_;         // of each group
  std::vector<Patch<Scalar>> patches_;    // of each vertex
  std::vector<PatchPull<Scalar>> pulls_;  // of each vertex
};

}  // namespace trephine
