// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/springs.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>
#include <trephine/tool/sag.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/element_size.hpp>

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
/// stiffness follows. The coupling's spring is stiffer by as much as contact yields (`CompensatedSpring`). Where the
/// tip's radius has more than kMaxRadius voxels, that many count.
struct CoupledGains {
  double shortest_spacing = 0;  ///< [m]
  FoundationLaw law{.stiffness = 1, .ramp = 1};
  VirtualCoupling coupling;
  std::size_t points_per_side = 1;  ///< of a surface element
  int level = 0;                    ///< of the surface's elements (`ElementSize`)
  double cut_allowance = 0;         ///< by which the cutting head is larger than the tool's [m]

  /// Derives the gains. `spacing` is the grid's [m].
  [[nodiscard]] static CoupledGains derive(const Burr& burr, const CoupledOptions& options,
                                           const Vec3d& spacing) noexcept {
    using C = CoupledConstants;
    const double h = spacing.minCoeff(), R = burr.tip_radius;
    // What contact resolves: a voxel, or a part of the radius where voxels are finer.
    const double resolved = std::max(h, R / C::kMaxRadius), a = C::kFootprint * resolved;
    const double yield = std::min({C::kMaxYield * resolved, a * a / (2 * R), C::kMaxYieldOfRadius * R,
                                   C::kMaxYieldOfExtension * (options.force / options.stiffness)});
    // The depth on a ball's contact has the slope √(2δ/R) at the rim, over a cell of kPointCell.
    const double ramp = C::kPointCell * resolved * std::sqrt(2 * yield / R);
    const double gain = options.force / BallOnPlane{1, R, ramp}.force(yield);
    const CompensatedSpring spring(options.stiffness, {gain, R, ramp}, yield);
    const double footprint = std::sqrt(2 * R * yield), skew = spacing.maxCoeff() < C::kSkewed * h ? 1 : C::kSkewed;
    // Where voxels are finer than what contact resolves: points in the largest cells that are as close as the footprint
    // needs along its radius. Else elements with as many points a side as it needs, more where they are long.
    const double fine = C::kFootprint * R / C::kMaxRadius;
    int level = ElementSize::kMaxLevel;
    while (level > 0 && C::kCrossingsPerRadius * skew * ElementSize::at_level(spacing, level).longest > fine) --level;
    const ElementSize size = ElementSize::at_level(spacing, level);
    const double side = level > 0 ? 1 : C::kPointsPerRadius * skew * size.longest / footprint;
    const BoundedSpring rotation_spring{options.rotational_stiffness, options.torque};
    CoupledGains gains{h,
                       {gain / std::numbers::pi, ramp, spring.offset()},
                       {spring, rotation_spring, options.has_torque()},
                       static_cast<std::size_t>(side < Foundation::kMaxSide ? std::ceil(side - C::kSideRounding)
                                                                            : double{Foundation::kMaxSide}),
                       level};
    // The tool fits the hole of a head that is larger by the contact's offset and by what the surface sags.
    gains.cut_allowance = spring.offset() + sag(spacing, size, level) / R;
    return gains;
  }

 private:
  /// Sag of the surface's elements below a ball's surface, on average, times its radius [m²].
  ///
  /// A chord sags by h² / 8R in the middle of a voxel's diagonal h, and by a third of that on average. Densities along
  /// an edge are interpolated, so crossings sag by h² / 12R on average where the edge is a tangent, and by 2/3 of that
  /// or less in all. Joined points sag by half their mean square distance from the centroid over R.
  [[nodiscard]] static double sag(const Vec3d& spacing, const ElementSize& size, int level) noexcept {
    if (level == 0) return sag_square(spacing, 1.0 / 24);
    return spacing.squaredNorm() / 54 + (size.cell.squaredNorm() - spacing.squaredNorm()) / 36;
  }
};

}  // namespace trephine
