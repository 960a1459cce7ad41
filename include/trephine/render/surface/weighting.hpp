// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/tool/patch.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <numbers>

/// How the springs of a group's colliding vertices are summed: thesis Eq. 15–17 and the alternatives. Vertex i is a_i
/// inside along its unit direction d_i toward the group's centre and stands for the area w_i. A policy gathers
/// Σ (weight · a_i d_i) and a divisor.
namespace trephine {

/// Eq. 16: F = k N_total / N_colliding Σ a_i d_i. As printed the force *falls* when one more vertex touches. k [N/m].
struct CollisionRatio {
  static constexpr bool kNormalised = true;
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar, Scalar, Scalar) noexcept {
    return Scalar(1);
  }
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar share(Scalar, Scalar, Scalar) noexcept {
    return Scalar(1);
  }
  [[nodiscard]] static double total(int vertices) noexcept { return vertices; }
};

/// Elastic (Winkler) foundation: F = k Σ w_i a_i d_i, k [N/m³]. On a plane exactly k π R δ² in the continuum.
struct AreaWeights {
  static constexpr bool kNormalised = false;
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar area, Scalar, Scalar) noexcept {
    return area;
  }
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar share(Scalar, Scalar, Scalar) noexcept {
    return Scalar(0);
  }
  [[nodiscard]] static double total(int) noexcept { return 1; }
};

/// The same law as `AreaWeights`, summed better: a vertex counts with what of the patch it stands for is in bone, and
/// pulls where that does, so that it enters contact as gradually as its patch (`PatchQuadrature`). k [N/m³].
struct PatchWeights : AreaWeights {};

template <class W>
inline constexpr bool kUsesPatches = std::same_as<W, PatchWeights>;

/// The mean spring over the touching area: F = k Σ w m a d / Σ w m, linear in depth on a plane (k δ/2 in the
/// continuum). A vertex enters with m = min(1, 4 a / R), so that the divisor does not jump when it touches. k [N/m].
struct MeanWeights {
  static constexpr bool kNormalised = true;
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar area, Scalar a, Scalar radius) noexcept {
    return area * std::min(Scalar(1), Scalar(4) * a / radius);
  }
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar share(Scalar area, Scalar a, Scalar radius) noexcept {
    return weight(area, a, radius);
  }
  [[nodiscard]] static double total(int) noexcept { return 1; }
};

template <class W>
concept Weighting = requires(float a) {
  { W::template weight<float>(a, a, a) }
  noexcept->std::same_as<float>;
  { W::template share<float>(a, a, a) }
  noexcept->std::same_as<float>;
  { W::total(1) }
  noexcept->std::same_as<double>;
  { W::kNormalised } -> std::convertible_to<bool>;
};

/// One group's sum in the making.
template <Weighting W, RealScalar Scalar>
class WeightedSum {
 public:
  void add(const Vec3<Scalar>& toward_centre, Scalar a, Scalar area, Scalar radius) noexcept {
    sum_ += (W::weight(area, a, radius) * a) * toward_centre;
    if constexpr (W::kNormalised) divisor_ += W::share(area, a, radius);
  }
  /// Times k: the group's force. `vertices` is the group's count.
  [[nodiscard]] Vec3<Scalar> result(int vertices) const noexcept {
    if constexpr (W::kNormalised) {
      if (!(divisor_ > Scalar(0))) return Vec3<Scalar>::Zero();
      return (static_cast<Scalar>(W::total(vertices)) / divisor_) * sum_;
    } else {
      return sum_;
    }
  }

 private:
  Vec3<Scalar> sum_ = Vec3<Scalar>::Zero();
  Scalar divisor_ = Scalar(0);
};

/// The force per k of one group's own vertices pressed `depth` [m] into a half space whose outward normal is `n` (unit,
/// in T), its centre staying outside: the law in closed form over the actual vertices. `tool` is a
/// ToolDiscretization<SurfaceCounts>, `g` the group.
template <Weighting W, class Tool>
[[nodiscard]] Vec3d plane_law(const Tool& tool, std::size_t g, double depth, const Vec3d& n) {
  const auto& group = tool.groups()[g];
  const double radius = static_cast<double>(group.radius);
  WeightedSum<W, double> sum;
  for (int i = group.first; i < group.first + group.count; ++i) {
    const Vec3d d = tool.inward()[i].template cast<double>();
    const double below = depth - radius * (1 - d.dot(n));  // of the vertex under the plane
    const double grazing = d.dot(n);
    double way = below > 0 && grazing > 0 ? below / grazing : 0;
    Vec3d toward = d;
    if constexpr (kUsesPatches<W>) {
      const PatchPull<double> pull = tool.patch(i).template cast<double>().pull(below, n, d, Vec3d::UnitZ());
      way = pull.way;
      toward = pull.toward;
    }
    if (way > 0) sum.add(toward, way, static_cast<double>(tool.areas()[static_cast<std::size_t>(i)]), radius);
  }
  return sum.result(group.count);
}

/// The same along the normal, at `depth` radii and averaged over the plane's directions (for a slice those square to
/// the shaft): a stated stiffness must hold for a tool however it is turned.
template <Weighting W, class Tool>
[[nodiscard]] double mean_plane_force(const Tool& tool, std::size_t g, double depth) {
  constexpr int kDirections = 720;
  const SphereLayout around = spread_over_sphere(kDirections);
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Vec3d n =
        g == 0 ? around.directions[static_cast<std::size_t>(i)] : Vec3d(std::cos(angle), std::sin(angle), 0);
    sum += plane_law<W>(tool, g, depth * static_cast<double>(tool.groups()[g].radius), n).dot(n);
  }
  return sum / kDirections;
}

/// Tangent stiffness [N/m] of a law of literal stiffness k where the ball presses on a plane with `force` [N]: at most
/// one radius deep, and half a radius deep for a force of 0.
template <Weighting W, class Tool>
[[nodiscard]] double plane_tangent(const Tool& tool, double k, double force) {
  constexpr double kApart = 0.05;  // radii; a law of squares has no error by it
  double low = force > 0 ? 0 : 0.5, high = force > 0 ? 1 : 0.5;
  for (int i = 0; i < 10 && low < high; ++i) {
    const double middle = (low + high) / 2;
    (k * mean_plane_force<W>(tool, 0, middle) < force ? low : high) = middle;
  }
  const double from = std::max((low + high) / 2 - kApart, 0.0), to = std::min((low + high) / 2 + kApart, 1.0);
  const double rise = mean_plane_force<W>(tool, 0, to) - mean_plane_force<W>(tool, 0, from);
  return k * rise / ((to - from) * tool.burr().tip_radius);
}

}  // namespace trephine
