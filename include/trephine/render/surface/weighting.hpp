// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/tool/patch.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <numbers>

/// Weighting policies: the sum of the springs of a group's vertices, by thesis Eq. 15–17 and alternatives. Vertex i has
/// the exit distance a_i along its unit direction d_i toward the group's centre, and a patch of area w_i. The force is
/// k · numerator · Σ (weight · a_i d_i) / Σ divisor_term.
namespace trephine::inline TREPHINE_ALIGNED {

/// Eq. 16: F = k N_total / N_colliding Σ a_i d_i, k [N/m]. As printed, the force *falls* when one more vertex collides.
struct CollisionRatio {
  static constexpr bool kNormalised = true;
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar, Scalar, Scalar) noexcept {
    return Scalar(1);
  }
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar divisor_term(Scalar, Scalar, Scalar) noexcept {
    return Scalar(1);
  }
  [[nodiscard]] static double numerator(int vertices) noexcept { return vertices; }
};

/// Elastic (Winkler) foundation: F = k Σ w_i a_i d_i, k [N/m³]. On a plane exactly k π R δ² in the continuum.
struct AreaWeights {
  static constexpr bool kNormalised = false;
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar area, Scalar, Scalar) noexcept {
    return area;
  }
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar divisor_term(Scalar, Scalar, Scalar) noexcept {
    return Scalar(0);
  }
  [[nodiscard]] static double numerator(int) noexcept { return 1; }
};

/// The law of `AreaWeights`, integrated over each vertex's patch instead of sampled at the vertex (`PatchQuadrature`).
/// A vertex therefore enters contact as gradually as its patch. k [N/m³].
struct PatchWeights : AreaWeights {
  static constexpr bool kUsesPatches = true;
};

/// True if a weighting asks for patch integrals, by a member `kUsesPatches` that is true.
template <class W>
inline constexpr bool kUsesPatches = requires {
  requires W::kUsesPatches;
};

/// Mean spring over the contact area: F = k Σ w m a d / Σ w m, k [N/m]. It is linear in depth on a plane (k δ/2 in the
/// continuum). A vertex enters with m = min(1, 4 a / R), so that the divisor is continuous.
struct MeanWeights {
  static constexpr bool kNormalised = true;
  static constexpr int kRamp = 4;  ///< a vertex has its full weight from an exit distance of R/4 on
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar area, Scalar a, Scalar radius) noexcept {
    return area * std::min(Scalar(1), Scalar(kRamp) * a / radius);
  }
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar divisor_term(Scalar area, Scalar a, Scalar radius) noexcept {
    return weight(area, a, radius);
  }
  [[nodiscard]] static double numerator(int) noexcept { return 1; }
};

/// A weighting policy. All lengths are in metres.
/// - `weight(area, a, radius)` is the factor of the vertex's spring a d;
/// - `divisor_term(area, a, radius)` is its term of the divisor, used if `kNormalised`;
/// - `numerator(vertices)` is the factor of the sum, for a group of so many vertices.
template <class W>
concept Weighting = requires(float a) {
  { W::template weight<float>(a, a, a) }
  noexcept->std::same_as<float>;
  { W::template divisor_term<float>(a, a, a) }
  noexcept->std::same_as<float>;
  { W::numerator(1) }
  noexcept->std::same_as<double>;
  { W::kNormalised } -> std::convertible_to<bool>;
};

/// Accumulates one group's force by a weighting policy.
template <Weighting W, RealScalar Scalar>
class WeightedSum {
 public:
  /// Adds a vertex with exit distance a [m] along the unit vector `toward_centre`, patch area [m²] and group radius
  /// [m].
  void add(const Vec3<Scalar>& toward_centre, Scalar a, Scalar area, Scalar radius) noexcept {
    sum_ += (W::weight(area, a, radius) * a) * toward_centre;
    if constexpr (W::kNormalised) divisor_ += W::divisor_term(area, a, radius);
  }
  /// The group's force divided by k. `vertices` is the number of vertices of the group.
  [[nodiscard]] Vec3<Scalar> result(int vertices) const noexcept {
    if constexpr (W::kNormalised) {
      if (!(divisor_ > Scalar(0))) return Vec3<Scalar>::Zero();
      return (static_cast<Scalar>(W::numerator(vertices)) / divisor_) * sum_;
    } else {
      return sum_;
    }
  }

 private:
  Vec3<Scalar> sum_ = Vec3<Scalar>::Zero();
  Scalar divisor_ = Scalar(0);
};

/// Force divided by k of group g pressed `depth` [m] into a half space with outward unit normal n (in T), its centre
/// outside. It is the sum over the group's actual vertices, in T axes. `tool` is a ToolDiscretization<SurfaceCounts>.
template <Weighting W, class Tool>
[[nodiscard]] Vec3d plane_law(const Tool& tool, std::size_t g, double depth, const Vec3d& n) {
  const auto& group = tool.groups()[g];
  WeightedSum<W, double> sum;
  for (int i = group.first; i < group.first + group.count; ++i) {
    const Vec3d d = tool.inward()[i].template cast<double>();
    const double cosine = d.dot(n), radius = static_cast<double>(tool.radius(i));
    const double vertex_depth = depth - (static_cast<double>(group.radius) - radius * cosine);
    double length = vertex_depth > 0 && cosine > 0 ? vertex_depth / cosine : 0;
    Vec3d direction = d;
    if constexpr (kUsesPatches<W>) {
      const PatchSpring<double> spring =
          tool.patch(i).template cast<double>().spring(vertex_depth, n, d, tool.along(i).template cast<double>());
      length = spring.length;
      direction = spring.direction;
    }
    if (length > 0) sum.add(direction, length, static_cast<double>(tool.areas()[static_cast<std::size_t>(i)]), radius);
  }
  return sum.result(group.count);
}

/// Normal component of `plane_law` at `depth` radii, averaged over the plane's directions (for a slice, directions
/// perpendicular to the shaft). The average makes a stated stiffness independent of the tool's orientation. A tip that
/// is no ball faces forward alone: its plane is across the axis.
template <Weighting W, class Tool>
[[nodiscard]] double mean_plane_force(const Tool& tool, std::size_t g, double depth) {
  const double at = depth * static_cast<double>(tool.groups()[g].radius);
  if (g == 0 && !tool.has_ball()) return plane_law<W>(tool, g, at, Vec3d::UnitZ()).z();
  constexpr int kDirections = 720;  // of the average; every half degree round a slice
  const SphereLayout sphere = spread_over_sphere(kDirections);
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Vec3d n =
        g == 0 ? sphere.directions[static_cast<std::size_t>(i)] : Vec3d(std::cos(angle), std::sin(angle), 0);
    sum += plane_law<W>(tool, g, at, n).dot(n);
  }
  return sum / kDirections;
}

/// Tangent stiffness [N/m] of the ball pressed on a plane with `force` [N], for a law of literal stiffness k. The depth
/// is limited to a radius. A force of 0 gives the stiffness at half a radius.
template <Weighting W, class Tool>
[[nodiscard]] double plane_tangent(const Tool& tool, double k, double force) {
  constexpr double kDifference = 0.05;  // half step of the central difference, in radii; exact for a quadratic law
  double low = force > 0 ? 0 : 0.5, high = force > 0 ? 1 : 0.5;
  constexpr int kBisections = 10;  // a depth within a thousandth of a radius
  for (int i = 0; i < kBisections && low < high; ++i) {
    const double middle = (low + high) / 2;
    (k * mean_plane_force<W>(tool, 0, middle) < force ? low : high) = middle;
  }
  const double from = std::max((low + high) / 2 - kDifference, 0.0), to = std::min((low + high) / 2 + kDifference, 1.0);
  const double rise = mean_plane_force<W>(tool, 0, to) - mean_plane_force<W>(tool, 0, from);
  return k * rise / ((to - from) * tool.burr().tip_radius);
}

}  // namespace trephine
