// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <concepts>

namespace trephine::inline TREPHINE_ALIGNED {

/// A field that returns a clearance for less than the cost of a sample: a radius [m] around p_G that holds no bone.
/// It is a lower bound; 0 also means that the clearance is unknown.
template <class F>
concept ClearanceField = requires(const F& f, const Vec3<typename F::Scalar>& p) {
  { f.clearance_at(p) }
  noexcept->std::same_as<typename F::Scalar>;
};

/// A field that can decide if a whole ball, given by centre p_G and radius [m], lies beyond the volume and in air.
template <class F>
concept BoundedField = requires(const F& f, const Vec3<typename F::Scalar>& p) {
  { f.is_beyond(p, typename F::Scalar{}) }
  noexcept->std::same_as<bool>;
};

/// Returns true if the ball of `radius` [m] around p_G holds no bone, without sampling the field. The test is
/// conservative: false also means that the clearance is unknown.
template <class Field, RealScalar Scalar>
[[nodiscard]] bool is_known_clear(const Field& field, const Vec3<Scalar>& p_G, Scalar radius) noexcept {
  if constexpr (BoundedField<Field>)
    if (field.is_beyond(p_G, radius)) return true;
  if constexpr (ClearanceField<Field>) return field.clearance_at(p_G) > radius;
  return false;
}

}  // namespace trephine
