// SPDX-License-Identifier: MIT
#pragma once

/// Every number that decides "close enough", with its reason, in one place.
namespace trephine {

/// Largest |RᵀR − I| entry a rotation may have: device drivers deliver single precision with a little drift.
inline constexpr double kRotationTolerance = 1e-3;
/// Farther from the world's origin than this [m] a pose is absurd: no haptic scene is a kilometre wide.
inline constexpr double kFarthestPosition = 1e3;
/// Larger than these [m] no tool and no voxel is: the number was meant in millimetres. A metre of radius would remove
/// the whole bone, and a voxel of half a metre would give a hundred newtons.
inline constexpr double kLargestRadius = 0.05;
inline constexpr double kLongestShaft = 1.0;
inline constexpr double kLargestSpacing = 0.02;
/// dt is clamped to this range [s]: 100 kHz is faster than any servo loop, a tenth of a second is a stall, not a tick.
inline constexpr double kShortestDt = 1e-5;
inline constexpr double kLongestDt = 0.1;
/// Gradients below this share of the grid's density range a voxel count as flat (a quarter level at 8 bit): no normal.
inline constexpr double kFlatShare = 1e-3;
/// Surface searches end when the bracket is shorter than this many voxels: a tenth of the finest error we report.
inline constexpr double kSurfaceTolerance = 1e-3;
/// What is known to be clear of bone is so this many voxels farther: single precision puts points a little elsewhere.
inline constexpr double kClearanceMargin = 0.01;

}  // namespace trephine
