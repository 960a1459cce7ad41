// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <optional>

/// Options of the Surface approximation, and its report on each group of vertices.
namespace trephine::inline TREPHINE_ALIGNED {

struct SurfaceOptions {
  /// Secant stiffness k [N/m] of the tip pressed on a plane at depth δ = R/2. The
  /// force grows with the square of the depth, F = 2 k δ²/R. The tangent stiffness, which decides stability on a
  /// device, is therefore 2 k at R/2 and at most 4 k near R. The renderer's `tangent_stiffness` returns it for a given
  /// force.
  double stiffness = 800;
  /// Largest step of a vertex's search for the surface, in voxels.
  double search_step = 0.5;
  /// Largest motion of the tip between two ticks [m]. Beyond it contact is reset (`ProxyOptions::jump`).
  double jump = 0.005;
  /// Limits the tangent stiffness at T, of all groups together, to the device's range. Without it the groups'
  /// stiffnesses add up. A budget that the tool cannot exceed changes nothing.
  std::optional<StiffnessBudget> budget{};

  void validate() const {
    if (!(stiffness > 0) || !is_finite(stiffness)) refuse("SurfaceOptions", "stiffness must be > 0 N/m", stiffness);
    if (!(search_step > 0 && search_step <= 4))
      refuse("SurfaceOptions", "search_step must be > 0 and at most 4 voxels", search_step);
    if (!(jump > 0)) refuse("SurfaceOptions", "jump must be > 0 m", jump);
    if (budget) budget->validate();
  }
};

/// Result of the last tick for one group (thesis Fig. 23, 24), in G. Group 0 is the ball, the others are the slices.
template <RealScalar Scalar>
struct SliceReport {
  int contacts = 0;   ///< vertices of the periphery with a spring
  bool deep = false;  ///< the centre is in bone
  Scalar lever_m =
      0;  ///< |r_j| from the tip to the point of action of F_j: at the slice's centre, or near it (patches)
  Vec3<Scalar> force = Vec3<Scalar>::Zero();   ///< F_j
  Vec3<Scalar> torque = Vec3<Scalar>::Zero();  ///< T_j = r_j × F_j (Eq. 20)
};

}  // namespace trephine
