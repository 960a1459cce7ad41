// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/counts.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/tool/patch.hpp>

#include <numbers>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Directions on the unit sphere with their quadrature weights, which sum to 1.
struct SphereLayout {
  std::vector<Vec3d> directions;
  std::vector<double> weights;
};

/// Spreads `count` directions over the unit sphere. 26 directions are the thesis' layout: a cube's face centres (6),
/// edge centres (12) and corners (8). Their weights are those of the 26-point Lebedev rule (1/21, 4/105, 9/280), exact
/// for polynomials up to degree 7 (Lebedev 1976). Any other count gives a Fibonacci spiral with equal weights.
[[nodiscard]] inline SphereLayout spread_over_sphere(int count) {
  SphereLayout layout;
  if (count == 26) {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const int nonzero = (x != 0) + (y != 0) + (z != 0);
          if (nonzero == 0) continue;
          layout.directions.push_back(Vec3d(x, y, z).normalized());
          layout.weights.push_back(nonzero == 1 ? 1.0 / 21 : nonzero == 2 ? 4.0 / 105 : 9.0 / 280);
        }
    return layout;
  }
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    layout.directions.push_back({r * std::cos(golden * i), r * std::sin(golden * i), z});
    layout.weights.push_back(1.0 / count);
  }
  return layout;
}

/// Vertices of the Surface approximation, in groups: the ball, then the slices from the tip up. The peripheries of all
/// groups are first, the groups' centres last, so that one batch samples all.
template <RealScalar S>
class ToolDiscretization<SurfaceCounts, S, Burr> {
 public:
  using Scalar = S;
  static constexpr int kMaxVertices = 100000;  ///< on the ball; bounds memory and the work of a tick

  /// Ball or slice.
  struct Group {
    int first = 0;    ///< its periphery is vertices first .. first + count − 1
    int count = 0;    ///< vertices of its periphery
    int centre = 0;   ///< index of its centre vertex
    Scalar height{};  ///< of its centre above T's origin, along +z [m]
    Scalar radius{};  ///< of the periphery about the centre; of a tip that is no ball, along the axis [m]
  };

  /// Throws std::invalid_argument for an invalid burr or counts outside their ranges: sphere 4 to 100000; if the burr
  /// has a shaft, slices 1 to 10000 and per_slice 3 to 1000.
  ToolDiscretization(const Burr& burr, const SurfaceCounts& counts) : burr_(burr) {
    burr.validate();
    check_counts(counts, burr.has_shaft());
    const double R = burr.tip_radius;
    const SphereLayout ball = spread_over_sphere(counts.sphere);
    const double ball_area = 4 * std::numbers::pi * R * R;
    begin_group(counts.sphere, 0, R);
    for (std::size_t i = 0; i < ball.directions.size(); ++i)
      add_vertex(R * ball.directions[i], -ball.directions[i], R, ball_area * ball.weights[i]);
    if (burr.has_shaft()) add_slices(counts);
    add_centres();
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  /// Number of vertices, centres included: 207 for the thesis' 26 + 1 + 20·(8 + 1).
  [[nodiscard]] int count() const noexcept { return count_; }
  /// The same with padding, a multiple of kLane.
  [[nodiscard]] int padded() const noexcept { return points_.size(); }
  /// Number of vertices on the peripheries.
  [[nodiscard]] int periphery() const noexcept { return inward_.size(); }
  [[nodiscard]] const PointArrays<Scalar>& points() const noexcept { return points_; }
  /// Unit direction from each vertex of the periphery to its group's centre.
  [[nodiscard]] const PointArrays<Scalar>& inward() const noexcept { return inward_; }
  /// Distance of vertex i of the periphery from its group's centre [m].
  [[nodiscard]] Scalar radius(int i) const noexcept { return radii_[static_cast<std::size_t>(i)]; }
  /// Unit direction along the tool at vertex i of the periphery: in a slice across its inward direction, in group 0
  /// the axis.
  [[nodiscard]] Vec3<Scalar> along(int i) const noexcept {
    const auto n = static_cast<std::size_t>(i);
    if (i < groups_[0].count || inward_.z[n] == Scalar(0)) return Vec3<Scalar>::UnitZ();
    return (Vec3<Scalar>::UnitZ() - inward_.z[n] * inward_[i]).normalized();
  }
  /// True if group 0 is a whole ball; else it is the tip of another tool, which faces forward.
  [[nodiscard]] bool has_ball() const noexcept { return has_ball_; }
  /// Area of each vertex's patch [m²]. A ball's areas sum to 4πR², the slices' areas to the shaft's lateral surface.
  [[nodiscard]] const std::vector<Scalar>& areas() const noexcept { return areas_; }
  [[nodiscard]] const std::vector<Group>& groups() const noexcept { return groups_; }
  /// Index of the group of vertex i of the periphery.
  [[nodiscard]] std::size_t group_of(int i) const noexcept {
    const int ball = groups_[0].count;
    return i < ball ? 0 : 1 + static_cast<std::size_t>((i - ball) / groups_[1].count);
  }
  /// Patch of vertex i of the periphery.
  [[nodiscard]] Patch<Scalar> patch(int i) const noexcept {
    const std::size_t g = group_of(i);
    const Scalar area = areas_[static_cast<std::size_t>(i)];
    const Scalar radius = radii_[static_cast<std::size_t>(i)];
    if (g == 0) return {.radius = radius, .disc = std::sqrt(area / std::numbers::pi_v<Scalar>)};
    const Scalar half_arc = std::numbers::pi_v<Scalar> * radius / static_cast<Scalar>(groups_[g].count);
    // Bone is not flat along a long piece of shaft. Slices farther apart than the shaft's radius are rings without
    // length.
    const Scalar half_length = area / (Scalar(4) * half_arc);
    return {.radius = radius,
            .half_arc = half_arc,
            .half_length = half_length > radius / Scalar(2) ? Scalar(0) : half_length};
  }

 protected:
  // For tools that are no burr and add their own vertices. `burr` has the tool's size.
  struct Empty {};
  ToolDiscretization(Empty, const Burr& burr) : burr_(burr), has_ball_(false) {}

  static void check_counts(const SurfaceCounts& counts, bool has_slices) {
    if (!(counts.sphere >= 4 && counts.sphere <= kMaxVertices))
      refuse("ToolDiscretization", "sphere vertices must be 4 to 100000", counts.sphere);
    if (!has_slices) return;
    if (!(counts.slices >= 1 && counts.slices <= 10000))
      refuse("ToolDiscretization", "slices must be 1 to 10000", counts.slices);
    if (!(counts.per_slice >= 3 && counts.per_slice <= 1000))
      refuse("ToolDiscretization", "vertices per slice must be 3 to 1000", counts.per_slice);
  }
  void begin_group(int count, double height, double radius) {
    groups_.push_back({periphery(), count, 0, static_cast<Scalar>(height), static_cast<Scalar>(radius)});
  }
  void add_vertex(const Vec3d& p, const Vec3d& inward, double radius, double area) {
    points_.push_back(p);
    inward_.push_back(inward);
    radii_.push_back(static_cast<Scalar>(radius));
    areas_.push_back(static_cast<Scalar>(area));
  }
  /// Adds the groups' centres. Call it last.
  void add_centres() {
    for (auto& g : groups_) {
      g.centre = points_.size();
      points_.push_back({0, 0, static_cast<double>(g.height)});
    }
    count_ = points_.size();
    points_.pad();
  }

 private:
  // Each slice is in the middle of its length of shaft.
  void add_slices(const SurfaceCounts& counts) {
    const double R = burr_.shaft_radius;
    const double from = burr_.shaft_emerges();
    const double length = (burr_.shaft_length - from) / counts.slices;
    const double area = 2 * std::numbers::pi * R * length / counts.per_slice;
    for (int s = 0; s < counts.slices; ++s) {
      const double z = from + (s + 0.5) * length;
      begin_group(counts.per_slice, z, R);
      for (int v = 0; v < counts.per_slice; ++v) {
        const double angle = 2 * std::numbers::pi * v / counts.per_slice;
        const Vec3d outward(std::cos(angle), std::sin(angle), 0);
        add_vertex(R * outward + Vec3d(0, 0, z), -outward, R, area);
      }
    }
  }

  Burr burr_;
  bool has_ball_ = true;
  int count_ = 0;
  PointArrays<Scalar> points_;
  PointArrays<Scalar> inward_;
  std::vector<Scalar> radii_, areas_;
  std::vector<Group> groups_;
};

}  // namespace trephine
