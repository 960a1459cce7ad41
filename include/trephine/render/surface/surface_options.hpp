// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <cmath>
#include <optional>

/// What a Surface approximation is told, and what it tells of its groups.
namespace trephine {

struct SurfaceOptions {
  /// Secant stiffness k [N/m] of the tip pressed on a plane at δ = R/2. The force is no plain spring's but grows with
  /// the square of the depth, F = 2 k δ²/R (PatchWeights, AreaWeights). So the tangent, which a device has to bear, is
  /// 2 k at R/2 and at most 4 k near R; `tangent_stiffness` of the renderer tells it at a force.
  double stiffness = 800;
  /// The literal k of Eq. 15 instead, in the unit of the weighting: N/m for CollisionRatio and MeanWeights, N/m³ for
  /// PatchWeights and AreaWeights. With N sphere vertices CollisionRatio at k feels like N k / 2.
  std::optional<double> thesis_stiffness{};
  /// Steps of a vertex's search for the surface are at most this many voxels.
  double search_step = 0.5;
  /// A tip that moves farther than this between two ticks [m] has jumped, as for a proxy (`ProxyOptions::jump`).
  double jump = 0.005;
  /// Keeps the tangent stiffness at T, of all groups together, within a device's means; without it springs add up. One
  /// that the tool cannot exceed changes nothing.
  std::optional<StiffnessBudget> budget{};

  void validate() const {
    if (!(stiffness > 0) || !std::isfinite(stiffness)) refuse("SurfaceOptions", "stiffness must be > 0 N/m", stiffness);
    if (thesis_stiffness && (!(*thesis_stiffness > 0) || !std::isfinite(*thesis_stiffness)))
      refuse("SurfaceOptions", "thesis_stiffness must be > 0", *thesis_stiffness);
    if (!(search_step > 0 && search_step <= 4))
      refuse("SurfaceOptions", "search_step must be > 0 and at most 4 voxels", search_step);
    if (!(jump > 0)) refuse("SurfaceOptions", "jump must be > 0 m", jump);
    if (budget) budget->validate();
  }
};

/// What the last tick found on one group (thesis Fig. 23, 24), in G. Group 0 is the ball, the others the slices.
template <RealScalar Scalar>
struct SliceReport {
  int contacts = 0;    ///< colliding vertices of the periphery
  bool deep = false;   ///< the centre is in bone
  Scalar lever_m = 0;  ///< |r_j| from the tip to where F_j acts: the slice's centre, or near it (patches)
  Vec3<Scalar> force = Vec3<Scalar>::Zero();   ///< F_j
  Vec3<Scalar> torque = Vec3<Scalar>::Zero();  ///< T_j = r_j × F_j (Eq. 20)
};

}  // namespace trephine
