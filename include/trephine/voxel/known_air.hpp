// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <concepts>

namespace trephine {

/// A field that can tell, for less than samples cost, how far around a place there is no bone [m]. 0 may also mean that
/// it does not know.
template <class F>
concept KnowsAir = requires(const F& f, const Vec3<typename F::Scalar>& p) {
  { f.air_around(p) }
  noexcept->std::same_as<typename F::Scalar>;
};

}  // namespace trephine
