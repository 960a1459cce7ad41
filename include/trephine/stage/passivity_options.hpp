// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a `PassivityController`.
struct PassivityOptions {
  double stiffness = 800;                ///< rendered stably by the device [N/m], >= 0
  double angular_stiffness = 0.3;        ///< the same for rotation [N·m/rad], >= 0
  double delay = 0;                      ///< of the loop, without the hold [s], >= 0
  double quantum = 0;                    ///< of position readings [m], >= 0
  double angular_quantum = 0;            ///< [rad], >= 0
  double contact_stiffness = 0;          ///< largest tangent stiffness of the law [N/m]; 0: stored energy unknown
  double contact_angular_stiffness = 0;  ///< [N·m/rad]; 0: torque stores nothing
  double damping = 5;                    ///< largest injected [N·s/m], >= 0; below a tenth of 2 m/dt
  double angular_damping = 5e-3;         ///< [N·m·s/rad], >= 0
  double force = 1.5;                    ///< largest injected force [N], >= 0
  double torque = 0.03;                  ///< largest injected torque [N·m], >= 0
  double force_rate = 300;               ///< fastest change of the injected force [N/s], > 0
  double torque_rate = 6;                ///< fastest change of the injected torque [N·m/s], > 0
  double reserve = 10e-3;                ///< largest credit, and largest excess W [J], >= 0
  double memory = 0.2;                   ///< time constant of the decay of an excess [s], > 0

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    const auto at_least_zero = [](const char* rule, double v) {
      if (!(v >= 0) || !is_finite(v)) refuse("PassivityController", rule, v);
    };
    const auto above_zero = [](const char* rule, double v) {
      if (!(v > 0) || !is_finite(v)) refuse("PassivityController", rule, v);
    };
    at_least_zero("stiffness must be finite and >= 0 N/m", stiffness);
    at_least_zero("angular_stiffness must be finite and >= 0 N·m/rad", angular_stiffness);
    at_least_zero("delay must be finite and >= 0 s", delay);
    at_least_zero("quantum must be finite and >= 0 m", quantum);
    at_least_zero("angular_quantum must be finite and >= 0 rad", angular_quantum);
    at_least_zero("contact_stiffness must be finite and >= 0 N/m", contact_stiffness);
    at_least_zero("contact_angular_stiffness must be finite and >= 0 N·m/rad", contact_angular_stiffness);
    at_least_zero("damping must be finite and >= 0 N·s/m", damping);
    at_least_zero("angular_damping must be finite and >= 0 N·m·s/rad", angular_damping);
    at_least_zero("force must be finite and >= 0 N", force);
    at_least_zero("torque must be finite and >= 0 N·m", torque);
    above_zero("force_rate must be finite and > 0 N/s", force_rate);
    above_zero("torque_rate must be finite and > 0 N·m/s", torque_rate);
    at_least_zero("reserve must be finite and >= 0 J", reserve);
    above_zero("memory must be finite and > 0 s", memory);
  }
};

}  // namespace trephine
