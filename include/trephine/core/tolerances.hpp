// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

/// Tolerances and limits that several components share, each with its unit and its reason. Constants of one component
/// are at the top of its class.
namespace trephine::inline TREPHINE_ALIGNED {

/// Largest entry of |RᵀR − I| that a rotation may have. Device drivers deliver single precision with a little drift.
inline constexpr double kRotationTolerance = 1e-3;
/// Largest distance of a pose from the world's origin [m]. No haptic scene is a kilometre wide.
inline constexpr double kFarthestPosition = 1e3;
/// Distance from the bone [m] at which no hand works, and the time [s] after which a scene says so. Poses in
/// millimetres put the tool a thousand times as far off.
inline constexpr double kFarthestHand = 2.0;
inline constexpr double kFarTime = 1.0;
/// Largest radius and length of a tool [m] and largest voxel spacing [m]. Larger numbers were meant in millimetres: a
/// radius of a metre would remove the whole bone, and a voxel of half a metre would give a hundred newtons.
inline constexpr double kLargestRadius = 0.05;
inline constexpr double kLongestShaft = 1.0;
inline constexpr double kLargestSpacing = 0.02;
/// Range that dt is clamped to [s]. No servo loop is faster than 100 kHz; a tenth of a second is a stall, not a tick.
inline constexpr double kShortestDt = 1e-5;
inline constexpr double kLongestDt = 0.1;
/// Gradients below this fraction of the grid's density range per voxel count as flat and give no normal. The value is a
/// quarter of a grey level at 8 bit.
inline constexpr double kFlatShare = 1e-3;
/// Bracket length, in voxels, at which a surface search ends. It is a tenth of the smallest error that the bench
/// reports.
inline constexpr double kSurfaceTolerance = 1e-3;
/// Margin, in voxels, by which a ball beyond the volume must exceed a motion. It covers the rounding of points in
/// single precision.
inline constexpr double kBeyondMargin = 0.01;

}  // namespace trephine
