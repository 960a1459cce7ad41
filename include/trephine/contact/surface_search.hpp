// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/tolerances.hpp>

#include <algorithm>
#include <concepts>

/// Searches for the surface of a scalar field along a segment.
namespace trephine::inline TREPHINE_ALIGNED {

/// A scalar field with its surface at 0 and values >= 0 in bone, at points in a fixed frame. Surface searches and
/// proxies work on it.
// clang-format off
template <class F>
concept PointField = requires(const F& f, const Vec3<typename F::Scalar>& p, Vec3<typename F::Scalar>& n) {
  typename F::Scalar;
  { f.value(p) } noexcept -> std::same_as<typename F::Scalar>;
  { f.normal(p, n) } noexcept -> std::same_as<bool>;
  { f.voxel() } noexcept -> std::same_as<typename F::Scalar>;
};
// clang-format on

/// True if a field declares its normals smooth, as `SplineGradient` does.
template <class Field>
inline constexpr bool kSmoothNormals = requires { requires Field::kSmoothNormals; };

/// A field that can decide if a whole ball, given by centre p_G and radius [m], lies beyond the volume and in air.
template <class F>
concept BoundedField = requires(const F& f, const Vec3<typename F::Scalar>& p) {
  { f.is_beyond(p, typename F::Scalar{}) } noexcept -> std::same_as<bool>;
};

/// Returns true if the field knows, without a sample, that the ball of `radius` [m] around p_G is beyond the volume and
/// in air. False proves nothing.
template <class Field, RealScalar Scalar>
[[nodiscard]] bool is_known_beyond(const Field& field, const Vec3<Scalar>& p_G, Scalar radius) noexcept {
  if constexpr (BoundedField<Field>) return field.is_beyond(p_G, radius);
  return false;
}

/// Number of equal steps for a distance.
struct StepPlan {
  int count = 1;
  bool bounded = false;  ///< the limit made steps longer than requested
};
/// Plans steps of at most `length` [m] over `distance` [m]: at least one step, at most `max_steps`.
[[nodiscard]] inline StepPlan plan_steps(double distance, double length, int max_steps) noexcept {
  const double needed = std::ceil(distance / length);
  if (!(needed <= max_steps)) return {max_steps, true};
  return {std::max(1, static_cast<int>(needed)), false};
}

/// Result of a search along a segment: a bracket of the surface in fractions of the segment.
template <RealScalar Scalar>
struct Crossing {
  bool found = false;
  bool bounded = false;       ///< the step limit made steps longer than requested
  Scalar before = Scalar(0);  ///< fraction just before the surface
  Scalar after = Scalar(0);   ///< fraction just after the surface
};

namespace detail {
inline constexpr int kMaxBracketSteps = 12;  ///< of regula falsi; bounds the work
/// Regula falsi keeps this fraction of the bracket away from its ends, so that each step shrinks it.
inline constexpr double kBracketInset = 0.05;
}  // namespace detail

/// Finds the first sign change of `value` along the segment a → b. It marches in steps of at most `step` [m], at most
/// `max_steps` of them, then shrinks the bracket to kSurfaceTolerance voxels. `at_a` is the field's value at a.
///
/// A march can miss walls thinner than a step. Steps of half a voxel find every wall that a trilinear image shows at
/// least a voxel thick. Cost: a sample per step, and up to 12 more.
template <PointField Field, RealScalar Scalar = typename Field::Scalar>
[[nodiscard]] Crossing<Scalar> first_crossing(const Field& field, const Vec3<Scalar>& a, Scalar at_a,
                                              const Vec3<Scalar>& b, Scalar step, int max_steps) noexcept {
  const Vec3<Scalar> d = b - a;
  const Scalar length = d.norm();
  const StepPlan plan = plan_steps(static_cast<double>(length), static_cast<double>(step), max_steps);
  Crossing<Scalar> c{.bounded = plan.bounded};
  Scalar v0 = at_a;
  const bool from_bone = v0 >= Scalar(0);
  Scalar v1 = v0;
  for (int i = 1; i <= plan.count && !c.found; ++i) {
    c.before = c.after;
    v0 = v1;
    c.after = static_cast<Scalar>(i) / static_cast<Scalar>(plan.count);
    // The last sample is b itself: a + (b − a) may round to the other side, and callers continue from b.
    v1 = field.value(i == plan.count ? b : Vec3<Scalar>(a + c.after * d));
    c.found = (v1 >= Scalar(0)) != from_bone;
  }
  if (!c.found) return c;
  // Illinois method: regula falsi that halves the value of an end kept twice, so that both ends converge.
  const Scalar tolerance = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
  constexpr auto kInset = static_cast<Scalar>(detail::kBracketInset);
  constexpr auto kOutset = static_cast<Scalar>(1 - detail::kBracketInset);
  int kept = 0;
  for (int i = 0; i < detail::kMaxBracketSteps && (c.after - c.before) * length > tolerance; ++i) {
    Scalar f = v0 / (v0 - v1);
    f = f > kInset ? (f < kOutset ? f : kOutset) : kInset;
    const Scalar t = c.before + f * (c.after - c.before);
    const Scalar v = field.value(a + t * d);
    if ((v >= Scalar(0)) == from_bone) {
      c.before = t;
      v0 = v;
      if (kept == 1) v1 /= Scalar(2);
      kept = 1;
    } else {
      c.after = t;
      v1 = v;
      if (kept == 2) v0 /= Scalar(2);
      kept = 2;
    }
  }
  return c;
}

/// The same search without a known value at a: a sample more.
template <PointField Field, RealScalar Scalar = typename Field::Scalar>
[[nodiscard]] Crossing<Scalar> first_crossing(const Field& field, const Vec3<Scalar>& a, const Vec3<Scalar>& b,
                                              Scalar step, int max_steps) noexcept {
  return first_crossing(field, a, field.value(a), b, step, max_steps);
}

}  // namespace trephine
