// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Largest tangent stiffness of a tool at T, for any number of contacts. It is the stiffness that the device renders
/// stably (`DeviceCapabilities`), in world units.
struct StiffnessBudget {
  double linear = 0;   ///< [N/m], > 0
  double angular = 0;  ///< about T [N·m/rad], > 0

  /// Throws std::invalid_argument for a number that is not finite and > 0.
  void validate() const {
    if (!(linear > 0) || !is_finite(linear)) refuse("StiffnessBudget", "linear must be > 0 N/m", linear);
    if (!(angular > 0) || !is_finite(angular)) refuse("StiffnessBudget", "angular must be > 0 N·m/rad", angular);
  }
};

}  // namespace trephine
