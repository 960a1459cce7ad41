// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <concepts>
#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {

/// The shaft adds its torque alone to the wrench, as in the thesis. A shaft contact then gives torque without force,
/// which is the gradient of no energy.
struct TorqueOnly {
  static constexpr bool kForce = false;
};
/// The shaft adds its force and its torque to the wrench.
struct FullWrench {
  static constexpr bool kForce = true;
};

/// Policy for the shaft's part of the wrench: `kForce` is true if the shaft adds its force.
template <class S>
concept ShaftForce = requires {
  { std::bool_constant<S::kForce>::value } -> std::convertible_to<bool>;
};

}  // namespace trephine
