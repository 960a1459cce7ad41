// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/surface_discretization.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <numbers>
#include <vector>

/// Vertices of tools that are no burr, for the Line and Surface approximations.
/// \code
/// SurfaceApproxRenderer drill{ToolDiscretization{tool_by_name("pear-2.3").tool, SurfaceCounts{}}};
/// \endcode
namespace trephine::inline TREPHINE_ALIGNED {

namespace detail {

/// Any shape that is a surface of revolution, and no burr.
template <class Shape>
concept Revolved = std::convertible_to<const Shape&, RevolvedTool> && !std::same_as<Shape, Burr>;

/// A ring of the outline's side, whose normals meet on the axis.
struct SideRing {
  ToolOutline::Place at;
  double height;  ///< of the place on the axis [m]
  double radius;  ///< distance from there [m]
  double area;    ///< of the band that it stands for [m²]
};

/// A tool's surface for its vertices: a *tip*, which faces forward, and rings on its *side* above.
///
/// The tip ends where the outline first does not face forward, at most at the height of T's origin. A ball about T's
/// origin belongs to it as a whole. Springs of its vertices point to T's origin, as a ball's do.
///
/// Springs of the side point along the normal. Where that does not meet the axis within the tool there is no ring: on
/// faces that look to the handle.
class VertexPlaces {
 public:
  explicit VertexPlaces(const RevolvedTool& tool) : outline_(tool.outline()) {
    const double end = outline_.side_length();
    const double R = tool.burr().tip_radius;
    const auto is_tip = [&](double s) {
      const ToolOutline::Place p = outline_.place_at(s);
      return (p.z < 0 && p.normal_z < -kSame) || std::abs(std::hypot(p.rho, p.z) / R - 1) < kSame;
    };
    // The last step that is still on the tip, then the place within it.
    int step = 0;
    while (step < kSteps && is_tip(end * (step + 1) / kSteps)) ++step;
    double low = end * step / kSteps, high = end * std::min(step + 1, kSteps) / kSteps;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = (low + high) / 2;
      (is_tip(middle) ? low : high) = middle;
    }
    tip_end_ = low;
  }

  /// Length along the outline at which the tip ends [m].
  [[nodiscard]] double tip_end() const noexcept { return tip_end_; }
  /// Area of the surface between two lengths along the outline [m²].
  [[nodiscard]] double area(double from, double to) const noexcept { return outline_.area(from, to); }

  /// Place of the tip in the direction at the angle [rad] from −z, seen from T's origin. Returns false if the tip ends
  /// before.
  [[nodiscard]] bool find_on_tip(double angle, ToolOutline::Place& at) const noexcept {
    const auto angle_at = [&](double s) {
      const ToolOutline::Place p = outline_.place_at(s);
      return std::atan2(p.rho, -p.z);
    };
    if (angle > angle_at(tip_end_) + kSame) return false;
    double low = 0, high = tip_end_;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = (low + high) / 2;
      (angle_at(middle) < angle ? low : high) = middle;
    }
    at = outline_.place_at(high);
    return true;
  }

  /// Rings in the middle of `count` equal lengths of the side, from the tip up.
  [[nodiscard]] std::vector<SideRing> side(int count) const {
    std::vector<SideRing> rings;
    const double length = (outline_.side_length() - tip_end_) / count;
    for (int i = 0; i < count; ++i) {
      const double from = tip_end_ + i * length;
      const ToolOutline::Place at = outline_.place_at(from + length / 2);
      if (!(at.normal_rho > kSame)) continue;
      const double height = at.z - at.rho * at.normal_z / at.normal_rho;
      if (!(outline_.signed_distance(0, height) < 0)) continue;
      rings.push_back({at, height, at.rho / at.normal_rho, area(from, from + length)});
    }
    return rings;
  }

 private:
  static constexpr double kSame = 1e-9;   // rounding of an outline's measures, relative
  static constexpr int kSteps = 4096;     // along the outline, to find the tip's end
  static constexpr int kBisections = 60;  // to the last digit

  const ToolOutline& outline_;
  double tip_end_ = 0;
};

}  // namespace detail

/// Vertices of a tool that is no burr. For Line they lie on the centreline from one largest radius above T's origin,
/// as a burr's. For Surface group 0 is the tip and the other groups are slices, evenly along the outline; the counts
/// are as dense on the tip as `sphere` vertices on a whole ball. Slices on faces that look to the handle are left out.
/// The tool's head cuts.
template <class Counts, RealScalar S>
class ToolDiscretization<Counts, S, RevolvedTool> : public ToolDiscretization<Counts, S, Burr> {
  using Base = ToolDiscretization<Counts, S, Burr>;

 public:
  using Scalar = S;

  /// Throws std::invalid_argument for counts out of range.
  ToolDiscretization(const RevolvedTool& tool, const LineCounts& counts)
    requires std::same_as<Counts, LineCounts>
      : Base(tool.burr(), counts), head_(tool.cutting_head(0)) {}

  ToolDiscretization(const RevolvedTool& tool, const SurfaceCounts& counts)
    requires std::same_as<Counts, SurfaceCounts>
      : Base(typename Base::Empty{}, tool.burr()), head_(tool.cutting_head(0)) {
    Base::check_counts(counts, true);
    const detail::VertexPlaces places(tool);
    add_tip(places, spread_over_sphere(counts.sphere), tool.burr().tip_radius);
    for (const detail::SideRing& ring : places.side(counts.slices)) add_slice(ring, counts.per_slice);
    Base::add_centres();
  }

  [[nodiscard]] const CuttingHead& cutting_head() const noexcept { return head_; }

 private:
  void add_slice(const detail::SideRing& ring, int count) {
    Base::begin_group(count, ring.height, ring.radius);
    for (int v = 0; v < count; ++v) {
      const double angle = 2 * std::numbers::pi * v / count;
      const Vec3d out(std::cos(angle), std::sin(angle), 0), up = Vec3d::UnitZ();
      Base::add_vertex(ring.at.rho * out + ring.at.z * up, -(ring.at.normal_rho * out + ring.at.normal_z * up),
                       ring.radius, ring.area / count);
    }
  }

  // Each vertex stands for the surface that its share of all directions sees. The shares are scaled to the tip's area.
  void add_tip(const detail::VertexPlaces& places, const SphereLayout& layout, double R) {
    struct Vertex {
      Vec3d direction;
      double radius, area;
    };
    std::vector<Vertex> vertices;
    double sum = 0;
    for (std::size_t i = 0; i < layout.directions.size(); ++i) {
      const Vec3d& d = layout.directions[i];
      const double around = std::hypot(d.x(), d.y());
      ToolOutline::Place at{};
      if (!places.find_on_tip(std::atan2(around, -d.z()), at)) continue;
      const double L = std::hypot(at.rho, at.z), cosine = at.normal_rho * around + at.normal_z * d.z();
      vertices.push_back({d, L, layout.weights[i] * L * L / cosine});
      sum += vertices.back().area;
    }
    const double scale = places.area(0, places.tip_end()) / sum;
    Base::begin_group(static_cast<int>(vertices.size()), 0, R);
    for (const Vertex& v : vertices) Base::add_vertex(v.radius * v.direction, -v.direction, v.radius, scale * v.area);
  }

  CuttingHead head_;
};

template <class Counts, detail::Revolved Shape>
ToolDiscretization(const Shape&, const Counts&) -> ToolDiscretization<Counts, float, RevolvedTool>;

}  // namespace trephine
