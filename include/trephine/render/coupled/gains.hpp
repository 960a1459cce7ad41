// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/coupled/foundation.hpp>
#include <trephine/render/coupled/virtual_coupling.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trephine {

/// What follows from the tool, the options and the voxels: the law of contact, the coupling that makes up for it, how
/// many points a element has, and the burr that cuts what the tool fits into.
///
/// A ball pressed on a plane is held with a force in closed form (`BallOnPlane`). At the greatest force it is a third
/// of a voxel deep, or as deep as makes a footprint of kFootprint voxels radius where that is less; the law's stiffness
/// follows. The coupling's spring is stiffer by as much as contact yields (`CompensatedSpring`).
struct CoupledGains {
  /// Radius [shortest spacings] of the contact on a plane at the greatest force: some ten voxels, a hundred points.
  static constexpr double kFootprint = 1.8;
  /// Most that the contact yields on a plane [shortest spacings].
  static constexpr double kMostYield = 1.0 / 3;
  /// Voxels longer than this times their width have elements askew, longer by as much along their diagonals.
  static constexpr double kSkewed = 1.5;

  double voxel = 0;  ///< shortest spacing [m]
  FoundationLaw law{.stiffness = 1, .ramp = 1};
  VirtualCoupling coupling;
  std::size_t side = 1;  ///< points of a element along each side
  Burr cutting_burr;

  /// `longest_part`: how long a element is at most (`BoneSurface::longest_part`) [m].
  [[nodiscard]] static CoupledGains of(const Burr& burr, const CoupledOptions& options, bool turns,
                                       const Vec3d& spacing, double longest_part) noexcept {
    const double h = spacing.minCoeff(), R = burr.tip_radius, a = kFootprint * h;
    // A contact softer than the coupling could not be made up for.
    const double yield = std::min({kMostYield * h, a * a / (2 * R), R / 4, options.force / options.stiffness / 4});
    // Depths on a ball's contact slope by √(2δ/R) at its rim, and a point's cell is half a voxel wide.
    const double ramp = 0.5 * h * std::sqrt(2 * yield / R);
    const double gain = options.force / BallOnPlane{1, R, ramp}.force(yield);
    const CompensatedSpring spring(options.stiffness, {gain, R, ramp}, yield);
    // Half a voxel apart where a contact has kFootprint voxels, and nearer where elements are long or it is small.
    constexpr double kRounding = 1e-9;
    const double footprint = std::sqrt(2 * R * yield), skewed = spacing.maxCoeff() < kSkewed * h ? 1 : kSkewed;
    CoupledGains g{h,
                   {gain / std::numbers::pi, ramp, spring.offset()},
                   {spring, {options.rotational_stiffness, options.torque}, turns},
                   static_cast<std::size_t>(std::ceil(2 * kFootprint * skewed * longest_part / footprint - kRounding)),
                   burr};
    // Contact begins `offset` outside the tool, and chords of a ball's surface sag: by h² / 8R in the middle of a
    // voxel's diagonal h, by a third of that on the mean.
    g.cutting_burr.tip_radius = R + spring.offset() + spacing.squaredNorm() / (24 * R);
    return g;
  }
};

}  // namespace trephine
