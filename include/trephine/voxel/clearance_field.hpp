// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <concepts>

namespace trephine {

/// A field that can tell, for less than samples cost, how far around a place there is no bone [m]. 0 may also mean that
/// it does not know.
template <class F>
concept ClearanceField = requires(const F& f, const Vec3<typename F::Scalar>& p) {
  { f.clearance_at(p) }
  noexcept->std::same_as<typename F::Scalar>;
};

/// A field that can tell whether all within a radius [m] of a place lies where the volume has ended, in air.
template <class F>
concept BoundedField = requires(const F& f, const Vec3<typename F::Scalar>& p) {
  { f.is_beyond(p, typename F::Scalar{}) }
  noexcept->std::same_as<bool>;
};

/// Whether the field knows without a sample that no bone is within `radius` [m] of p_G. False may also mean that it
/// does not know.
template <class Field, RealScalar Scalar>
[[nodiscard]] bool is_known_clear(const Field& field, const Vec3<Scalar>& p_G, Scalar radius) noexcept {
  if constexpr (BoundedField<Field>)
    if (field.is_beyond(p_G, radius)) return true;
  if constexpr (ClearanceField<Field>) return field.clearance_at(p_G) > radius;
  return false;
}

}  // namespace trephine
