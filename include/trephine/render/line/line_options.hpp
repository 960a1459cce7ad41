// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/proxy_options.hpp>
#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <optional>

/// Options of the Line approximation, and its report on the shaft's contact.
namespace trephine::inline TREPHINE_ALIGNED {

struct LineOptions {
  double stiffness = 800;                   ///< k of Eq. 7 [N/m]
  std::optional<double> shaft_stiffness{};  ///< k of F_IntP = k g [N/m]; `stiffness` if not set
  ProxyOptions proxy{};                     ///< of tip and shaft: steps and work limits
  /// Motion of both ends of the centreline since t−1 up to which the tool counts as resting [m]: below the resolution
  /// of the finest encoders. Shorter motions accumulate until they exceed it.
  double rest_threshold = 1e-7;
  /// Largest motion of the drawn ball and shaft relative to the proxy, over the tool's own motion. It keeps the drawn
  /// tool from jumping by a radius at first contact. Infinite: at once, as in the thesis.
  double drawn_rate = 2;
  /// Limits the tangent stiffness at T, of tip and shaft together, to the device's range. The shaft's spring at a lever
  /// r has at most angular/r². Tip and shaft have at most half of `linear` each. These limits do not depend on the
  /// contacts, so the force has no jumps.
  std::optional<StiffnessBudget> budget{};

  /// Throws std::invalid_argument for a number outside its range.
  void validate() const {
    const auto positive = [](double v) { return v > 0 && is_finite(v); };
    if (!positive(stiffness)) refuse("LineOptions", "stiffness must be > 0 N/m", stiffness);
    if (shaft_stiffness && !positive(*shaft_stiffness))
      refuse("LineOptions", "shaft_stiffness must be > 0 N/m", *shaft_stiffness);
    if (!(rest_threshold >= 0) || !is_finite(rest_threshold))
      refuse("LineOptions", "rest_threshold must be >= 0 m", rest_threshold);
    if (!(drawn_rate > 0)) refuse("LineOptions", "drawn_rate must be > 0", drawn_rate);
    proxy.validate();
    if (budget) budget->validate();
  }
};

/// Result of the last tick for the shaft (thesis 3.1.3; Fig. 21, 22), in G.
template <RealScalar Scalar>
struct LineReport {
  bool shaft_contact = false;
  Vec3<Scalar> intersection = Vec3<Scalar>::Zero();  ///< IntP
  Vec3<Scalar> spring = Vec3<Scalar>::Zero();        ///< g = IntP − IntP_probe
  Scalar spring_m = 0;                               ///< |g|
  Scalar lever_m = 0;                                ///< |r|, r = IntP − p_proxy
  Scalar reaction_N = 0;                             ///< |F_IntP|
  Scalar torque_Nm = 0;                              ///< norm of the shaft's torque about T's origin
  int active = 0;                                    ///< active vertices of a first contact found in this tick
  Vec3<Scalar> tip_force = Vec3<Scalar>::Zero();     ///< of the tip's spring (Eq. 7) [N]
};

}  // namespace trephine
