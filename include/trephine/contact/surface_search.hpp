// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/tolerances.hpp>

#include <algorithm>
#include <concepts>

namespace trephine {

/// A scalar with its surface at 0 (>= 0 in bone), at points in one frame: what surface searches and proxies move on.
// clang-format off
template <class F>
concept PointField = requires(const F& f, const Vec3<typename F::Scalar>& p, Vec3<typename F::Scalar>& n) {
  typename F::Scalar;
  { f.value(p) } noexcept -> std::same_as<typename F::Scalar>;
  { f.normal(p, n) } noexcept -> std::same_as<bool>;
  { f.voxel() } noexcept -> std::same_as<typename F::Scalar>;
};
// clang-format on

/// Whether a field says that its normals are smooth (`SplineGradient`).
template <class Field>
inline constexpr bool kSmoothNormals = requires {
  requires Field::kSmoothNormals;
};

/// Steps of `length` [m] at most that cover `distance`, at least one, at most `most`. `bounded`: `most` was not enough
/// and steps are longer than asked.
struct StepPlan {
  int count = 1;
  bool bounded = false;
};
[[nodiscard]] inline StepPlan plan_steps(double distance, double length, int most) noexcept {
  const double wanted = std::ceil(distance / length);
  if (!(wanted <= most)) return {most, true};
  return {std::max(1, static_cast<int>(wanted)), false};
}

template <RealScalar Scalar>
struct Crossing {
  bool found = false;
  bool bounded = false;       ///< the step limit made steps longer than asked
  Scalar before = Scalar(0);  ///< fraction of the segment just before the surface
  Scalar after = Scalar(0);   ///< and just after it
};

/// First place where `value` changes side along the segment a → b, seen from a: marches in steps of at most `step` [m]
/// (at most `most` of them), then halves or interpolates the bracket down to kSurfaceTolerance voxels. A wall thinner
/// than a step can be stepped over; steps of half a voxel see every wall that the trilinear interpolant of a sampled
/// volume shows as thick as a voxel. `at_a`: the field's value at a. Cost: steps + up to 12 samples.
template <PointField Field, RealScalar Scalar = typename Field::Scalar>
[[nodiscard]] Crossing<Scalar> first_crossing(const Field& field, const Vec3<Scalar>& a, Scalar at_a,
                                              const Vec3<Scalar>& b, Scalar step, int most) noexcept {
  const Vec3<Scalar> d = b - a;
  const Scalar length = d.norm();
  const StepPlan plan = plan_steps(static_cast<double>(length), static_cast<double>(step), most);
  Crossing<Scalar> c{.bounded = plan.bounded};
  Scalar v0 = at_a;
  const bool from_bone = v0 >= Scalar(0);
  Scalar v1 = v0;
  for (int i = 1; i <= plan.count && !c.found; ++i) {
    c.before = c.after;
    v0 = v1;
    c.after = static_cast<Scalar>(i) / static_cast<Scalar>(plan.count);
    // The last sample is b itself: a + (b − a) may round to its other side, and callers go on from b.
    v1 = field.value(i == plan.count ? b : Vec3<Scalar>(a + c.after * d));
    c.found = (v1 >= Scalar(0)) != from_bone;
  }
  if (!c.found) return c;
  // Illinois: regula falsi that halves the value of an end it keeps twice, so that both ends close in.
  const Scalar close_enough = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
  int kept = 0;
  for (int i = 0; i < 12 && (c.after - c.before) * length > close_enough; ++i) {
    Scalar f = v0 / (v0 - v1);
    f = f > Scalar(0.05) ? (f < Scalar(0.95) ? f : Scalar(0.95)) : Scalar(0.05);
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

/// The same where the value at a is not known: one sample more.
template <PointField Field, RealScalar Scalar = typename Field::Scalar>
[[nodiscard]] Crossing<Scalar> first_crossing(const Field& field, const Vec3<Scalar>& a, const Vec3<Scalar>& b,
                                              Scalar step, int most) noexcept {
  return first_crossing(field, a, field.value(a), b, step, most);
}

}  // namespace trephine
