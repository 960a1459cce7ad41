// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

namespace trephine {

/// What the shaft adds to the wrench: its torque alone, as the thesis returns (a shaft contact then gives torque
/// without force, which is the gradient of no energy) …
struct TorqueOnly {
  static constexpr bool kForce = false;
};
/// … or its force too.
struct FullWrench {
  static constexpr bool kForce = true;
};

template <class S>
concept ShaftForce = std::same_as<S, TorqueOnly> || std::same_as<S, FullWrench>;

}  // namespace trephine
