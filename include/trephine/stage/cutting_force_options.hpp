// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/units.hpp>
#include <trephine/tool/cutting_edges.hpp>
#include <trephine/tool/cutting_law.hpp>

#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a `CuttingForce`.
struct CuttingForceOptions {
  CuttingEdges edges{};
  double speed = rpm(30'000);                                     ///< of the spindle without load [rad/s]
  bool clockwise = true;                                          ///< teeth turn clockwise, seen from the handle
  double stall_torque = std::numeric_limits<double>::infinity();  ///< [N·m]
  double inertia = 1e-6;                                          ///< of spindle and tool [kg m²]
  BoneStrength strength{};
  CuttingLaw law{};
  double force_scale = 1;  ///< share of the true forces that the device gets, in (0, 1]
  double lag = 0.005;      ///< time in which the spindle takes out e⁻¹ of a deposit, at its speed without load [s]

  /// Throws std::invalid_argument.
  void validate() const {
    edges.validate();
    strength.validate();
    law.validate();
    if (!(speed > 0) || !is_finite(speed)) refuse("CuttingForce", "speed must be > 0 rad/s", speed);
    if (!(stall_torque > 0)) refuse("CuttingForce", "stall_torque must be > 0 N·m", stall_torque);
    if (!(inertia > 0) || !is_finite(inertia)) refuse("CuttingForce", "inertia must be > 0 kg m2", inertia);
    if (!(force_scale > 0) || !(force_scale <= 1)) refuse("CuttingForce", "force_scale must be in (0, 1]", force_scale);
    if (!(lag > 0) || !(lag <= 1)) refuse("CuttingForce", "lag must be in (0, 1] s", lag);
  }
};

}  // namespace trephine
