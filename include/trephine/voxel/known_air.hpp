// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <concepts>

namespace trephine {

/// A field that can tell, for less than samples cost, that no bone is within a radius [m] of a place. False may also
/// mean that it does not know.
template <class F>
concept KnowsAir = requires(const F& f, const Vec3<typename F::Scalar>& p, typename F::Scalar r) {
  { f.is_clear(p, r) }
  noexcept->std::same_as<bool>;
};

}  // namespace trephine
