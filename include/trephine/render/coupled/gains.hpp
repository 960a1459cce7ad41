// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/springs.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>
#include <trephine/tool/sag.hpp>
#include <trephine/tool/shape.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace trephine::inline TREPHINE_ALIGNED {

/// Gains of a coupled tool, derived from the tool, the options and the voxels.
///
/// They are the contact's law, the coupling that compensates its yield, the points per element, and the room that cuts
/// make for the tool.
///
/// The force of a ball pressed on a plane has a closed form (`BallOnPlane`). At the largest force the ball yields by a
/// third of a voxel. It yields less if the footprint would have a radius over kFootprint voxels. The law's
/// stiffness follows. The coupling's spring is stiffer by as much as contact yields (`CompensatedSpring`).
struct CoupledGains {
  double shortest_spacing = 0;  ///< [m]
  FoundationLaw law{.stiffness = 1, .ramp = 1};
  VirtualCoupling coupling;
  std::size_t points_per_side = 1;  ///< of a surface element
  double cut_allowance = 0;         ///< by which the cutting head is larger than the tool's [m]

  /// Derives the gains. `spacing` is the grid's [m]; `longest_part` the largest length of an element
  /// (`BoneSurface::longest_part`) [m].
  [[nodiscard]] static CoupledGains derive(const Burr& burr, const CoupledOptions& options, const Vec3d& spacing,
                                           double longest_part) noexcept {
    using C = CoupledConstants;
    const double h = spacing.minCoeff(), R = burr.tip_radius, a = C::kFootprint * h;
    const double yield = std::min({C::kMaxYield * h, a * a / (2 * R), C::kMaxYieldOfRadius * R,
                                   C::kMaxYieldOfExtension * (options.force / options.stiffness)});
    // The depth on a ball's contact has the slope √(2δ/R) at the rim, over a cell of kPointCell voxels.
    const double ramp = C::kPointCell * h * std::sqrt(2 * yield / R);
    const double gain = options.force / BallOnPlane{1, R, ramp}.force(yield);
    const CompensatedSpring spring(options.stiffness, {gain, R, ramp}, yield);
    // Elements have as many points a side as the footprint needs along its radius: more where they are long.
    const double footprint = std::sqrt(2 * R * yield), skew = spacing.maxCoeff() < C::kSkewed * h ? 1 : C::kSkewed;
    const double side = C::kPointsPerRadius * skew * longest_part / footprint;
    const BoundedSpring rotation_spring{options.rotational_stiffness, options.torque};
    CoupledGains gains{h,
                       {gain / std::numbers::pi, ramp, spring.offset()},
                       {spring, rotation_spring, options.has_torque()},
                       static_cast<std::size_t>(side < Foundation::kMaxSide ? std::ceil(side - C::kSideRounding)
                                                                            : double{Foundation::kMaxSide})};
    // The tool fits the hole of a head that is larger by the contact's offset and by the sag of chords. A chord of a
    // ball's surface sags by h² / 8R in the middle of a voxel's diagonal h, and by a third of that on average.
    gains.cut_allowance = spring.offset() + sag_square(spacing, 1.0 / 24) / R;
    return gains;
  }
};

}  // namespace trephine
