// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/patch.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/sampling.hpp>

#include <numbers>
#include <vector>

namespace trephine {

/// Where the shaft's vertices begin. The thesis lets the cylinder start at the ball's centre; its part inside the ball
/// can touch nothing that the ball does not, and a vertex at the centre makes every press of the tip a shaft contact
/// too.
enum class ShaftStart {
  kEmerging,   ///< where the shaft leaves the ball
  kTipCentre,  ///< at the ball's centre (thesis)
};

/// Counts of the Line approximation (thesis 3.1): vertices along the shaft's centreline, first and last at its ends.
struct LineCounts {
  int shaft = 50;
  ShaftStart start = ShaftStart::kEmerging;
};

/// Counts of the Surface approximation (thesis 3.2). Each group (ball, slice) has one vertex at its centre in addition.
/// The default presses on smooth bone within 1 % of infinitely many (`bench/run`).
struct SurfaceCounts {
  int sphere = 260;
  int slices = 70;
  int per_slice = 8;
  ShaftStart start = ShaftStart::kEmerging;

  /// 207 vertices with the centres.
  [[nodiscard]] static constexpr SurfaceCounts thesis() noexcept {
    return {.sphere = 26, .slices = 20, .per_slice = 8};
  }
};

/// Points as separate arrays, padded to a multiple of kLane by copies of the last one (so padding finds nothing new).
template <RealScalar Scalar>
struct PointArrays {
  std::vector<Scalar> x, y, z;

  void push_back(const Vec3d& p) {
    x.push_back(static_cast<Scalar>(p.x()));
    y.push_back(static_cast<Scalar>(p.y()));
    z.push_back(static_cast<Scalar>(p.z()));
  }
  void pad() {
    const auto padded = static_cast<std::size_t>(padded_to_lane(size()));
    for (auto* a : {&x, &y, &z})
      if (!a->empty()) a->resize(padded, a->back());
  }
  [[nodiscard]] int size() const noexcept { return static_cast<int>(x.size()); }
  [[nodiscard]] Vec3<Scalar> operator[](int i) const noexcept {
    const auto n = static_cast<std::size_t>(i);
    return {x[n], y[n], z[n]};
  }
};

/// Directions spread over the unit sphere and the share of its area that each stands for (the shares sum to 1).
struct SphereLayout {
  std::vector<Vec3d> directions;
  std::vector<double> shares;
};

/// 26: the thesis' layout, the directions to a cube's face centres (6), edge centres (12) and corners (8), with the
/// weights of the 26-point Lebedev rule for those very points (1/21, 4/105, 9/280: exact for polynomials up to degree
/// 7; Lebedev 1976). Any other count: a Fibonacci spiral, whose points stand for equal areas.
[[nodiscard]] inline SphereLayout spread_over_sphere(int count) {
  SphereLayout layout;
  if (count == 26) {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const int nonzero = (x != 0) + (y != 0) + (z != 0);
          if (nonzero == 0) continue;
          layout.directions.push_back(Vec3d(x, y, z).normalized());
          layout.shares.push_back(nonzero == 1 ? 1.0 / 21 : nonzero == 2 ? 4.0 / 105 : 9.0 / 280);
        }
    return layout;
  }
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    layout.directions.push_back({r * std::cos(golden * i), r * std::sin(golden * i), z});
    layout.shares.push_back(1.0 / count);
  }
  return layout;
}

/// The vertices that stand for a tool, in the tool frame T. Immutable after construction. Specialised by what the
/// renderer needs: `ToolDiscretization{burr, LineCounts{…}}` or `ToolDiscretization{burr, SurfaceCounts{…}}`.
template <class Counts, RealScalar Scalar = float>
class ToolDiscretization;

template <class Counts>
ToolDiscretization(const Burr&, const Counts&) -> ToolDiscretization<Counts, float>;

/// Line vertices: the shaft's centreline. Vertex i lies at `heights()[i]` from T's origin along +z.
template <RealScalar S>
class ToolDiscretization<LineCounts, S> {
 public:
  using Scalar = S;
  static constexpr int kMostVertices = 100000;

  /// Throws std::invalid_argument for a burr that is none, or a count outside [1, 100000] for a tool with a shaft.
  ToolDiscretization(const Burr& burr, const LineCounts& counts) : burr_(burr) {
    burr.validate();
    if (!burr.has_shaft()) return;
    if (!(counts.shaft >= 1 && counts.shaft <= kMostVertices))
      refuse("ToolDiscretization", "shaft vertices must be 1 to 100000", counts.shaft);
    // The centreline, unlike the shaft's surface, leaves the ball at its pole.
    const double from = counts.start == ShaftStart::kTipCentre ? 0.0 : burr.tip_radius;
    for (int i = 0; i < counts.shaft; ++i) {
      const double share = counts.shaft == 1 ? 1.0 : static_cast<double>(i) / (counts.shaft - 1);
      points_.push_back({0, 0, from + share * (burr.shaft_length - from)});
    }
    count_ = counts.shaft;
    points_.pad();
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] int padded() const noexcept { return points_.size(); }
  [[nodiscard]] const PointArrays<Scalar>& points() const noexcept { return points_; }
  [[nodiscard]] const std::vector<Scalar>& heights() const noexcept { return points_.z; }
  /// The same burr without vertices on its shaft.
  [[nodiscard]] ToolDiscretization without_shaft() const {
    Burr ball = burr_;
    ball.shaft_length = 0;
    ToolDiscretization tool(ball, {});
    tool.burr_ = burr_;
    return tool;
  }

 private:
  Burr burr_;
  int count_ = 0;
  PointArrays<Scalar> points_;
};

/// Surface vertices, in groups: the ball, then the slices from the tip up. The periphery of all groups comes first,
/// then every group's centre, so that one batch samples all.
template <RealScalar S>
class ToolDiscretization<SurfaceCounts, S> {
 public:
  using Scalar = S;
  static constexpr int kMostVertices = 100000;

  struct Group {
    int first = 0;  ///< its periphery is vertices first .. first + count − 1
    int count = 0;
    int centre = 0;   ///< index of its centre vertex
    Scalar height{};  ///< of its centre above T's origin, along +z [m]
    Scalar radius{};  ///< [m]
  };

  /// Throws std::invalid_argument for a burr that is none or counts outside their range (sphere 4 to 100000; slices 1
  /// to 10000 and 3 or more per slice for a tool with a shaft).
  ToolDiscretization(const Burr& burr, const SurfaceCounts& counts) : burr_(burr) {
    burr.validate();
    if (!(counts.sphere >= 4 && counts.sphere <= kMostVertices))
      refuse("ToolDiscretization", "sphere vertices must be 4 to 100000", counts.sphere);
    const SphereLayout ball = spread_over_sphere(counts.sphere);
    const double ball_area = 4 * std::numbers::pi * burr.tip_radius * burr.tip_radius;
    groups_.push_back({0, counts.sphere, 0, Scalar(0), static_cast<Scalar>(burr.tip_radius)});
    for (std::size_t i = 0; i < ball.directions.size(); ++i)
      add_vertex(burr.tip_radius * ball.directions[i], -ball.directions[i], ball_area * ball.shares[i]);
    if (burr.has_shaft()) add_slices(counts);

    for (auto& g : groups_) {
      g.centre = points_.size();
      points_.push_back({0, 0, static_cast<double>(g.height)});
    }
    count_ = points_.size();
    points_.pad();
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  /// Vertices in all, centres included: 207 for the thesis' 26 + 1 + 20·(8 + 1).
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] int padded() const noexcept { return points_.size(); }
  [[nodiscard]] int periphery() const noexcept { return inward_.size(); }
  [[nodiscard]] const PointArrays<Scalar>& points() const noexcept { return points_; }
  /// Unit directions from the periphery's vertices toward their group's centre.
  [[nodiscard]] const PointArrays<Scalar>& inward() const noexcept { return inward_; }
  /// Area that each vertex of the periphery stands for [m²]; the ball's sum to 4πR², the slices' to the shaft's side.
  [[nodiscard]] const std::vector<Scalar>& areas() const noexcept { return areas_; }
  [[nodiscard]] const std::vector<Group>& groups() const noexcept { return groups_; }
  /// The group that vertex i of the periphery belongs to.
  [[nodiscard]] std::size_t group_of(int i) const noexcept {
    const int ball = groups_[0].count;
    return i < ball ? 0 : 1 + static_cast<std::size_t>((i - ball) / groups_[1].count);
  }
  /// The patch that vertex i of the periphery stands for.
  [[nodiscard]] Patch<Scalar> patch(int i) const noexcept {
    const std::size_t g = group_of(i);
    const Scalar area = areas_[static_cast<std::size_t>(i)];
    const Scalar radius = groups_[g].radius;
    if (g == 0) return {.radius = radius, .disc = std::sqrt(area / std::numbers::pi_v<Scalar>)};
    const Scalar half_arc = std::numbers::pi_v<Scalar> * radius / static_cast<Scalar>(groups_[g].count);
    // Along a length of shaft no bone is flat: where slices stand wider apart than the shaft is thick each is its ring
    // alone.
    const Scalar half_length = area / (Scalar(4) * half_arc);
    return {.radius = radius,
            .half_arc = half_arc,
            .half_length = half_length > radius / Scalar(2) ? Scalar(0) : half_length};
  }
  /// The same burr with vertices on its ball alone.
  [[nodiscard]] ToolDiscretization without_shaft() const {
    Burr ball = burr_;
    ball.shaft_length = 0;
    ToolDiscretization tool(ball, {.sphere = groups_[0].count});
    tool.burr_ = burr_;
    return tool;
  }

 private:
  void add_vertex(const Vec3d& p, const Vec3d& inward, double area) {
    points_.push_back(p);
    inward_.push_back(inward);
    areas_.push_back(static_cast<Scalar>(area));
  }

  // Each slice stands in the middle of the length of shaft it stands for.
  void add_slices(const SurfaceCounts& counts) {
    if (!(counts.slices >= 1 && counts.slices <= 10000))
      refuse("ToolDiscretization", "slices must be 1 to 10000", counts.slices);
    if (!(counts.per_slice >= 3 && counts.per_slice <= 1000))
      refuse("ToolDiscretization", "vertices per slice must be 3 to 1000", counts.per_slice);
    const double from = counts.start == ShaftStart::kTipCentre ? 0.0 : burr_.shaft_emerges();
    const double length = (burr_.shaft_length - from) / counts.slices;
    const double area = 2 * std::numbers::pi * burr_.shaft_radius * length / counts.per_slice;
    for (int s = 0; s < counts.slices; ++s) {
      const double z = from + (s + 0.5) * length;
      groups_.push_back(
          {points_.size(), counts.per_slice, 0, static_cast<Scalar>(z), static_cast<Scalar>(burr_.shaft_radius)});
      for (int v = 0; v < counts.per_slice; ++v) {
        const double angle = 2 * std::numbers::pi * v / counts.per_slice;
        const Vec3d out(std::cos(angle), std::sin(angle), 0);
        add_vertex(burr_.shaft_radius * out + Vec3d(0, 0, z), -out, area);
      }
    }
  }

  Burr burr_;
  int count_ = 0;
  PointArrays<Scalar> points_;
  PointArrays<Scalar> inward_;
  std::vector<Scalar> areas_;
  std::vector<Group> groups_;
};

}  // namespace trephine
