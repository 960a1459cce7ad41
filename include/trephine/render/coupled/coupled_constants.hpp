// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <cstddef>

namespace trephine::inline TREPHINE_ALIGNED {

/// Every number that decides how the coupled tool behaves, with its meaning, unit, reason and effect.
///
/// "Spacings" are the grid's shortest spacing. `bench/constants.py` changes each number by a fifth and reports the
/// figures that pass their bound.
struct CoupledConstants {
  // --- Gains: the stiffness of contact (gains.hpp).

  /// Largest radius of the contact on a plane at the largest force [spacings]. It holds some fourteen elements. A
  /// smaller footprint makes contact stiffer and the force rougher: from 1.5 down directions err by over half a degree.
  /// A larger one lets large burrs sink in farther.
  static constexpr double kFootprint = 2.1;
  /// Radius of the tip from which on finer voxels do not make contact finer [spacings]. Footprint and points are then
  /// parts of the radius, so the work of a tick's contact does not grow with the voxels. The hole is then larger than
  /// the tool by a thousandth of its radius.
  static constexpr double kMaxRadius = 15;
  /// Points along the footprint's radius, at least. More of them make the force smoother, and ticks longer.
  static constexpr double kPointsPerRadius = 3.6;
  /// Cells of points at the surface's crossings along the footprint's radius, at least, where voxels are that fine.
  /// They lie on the surface itself, so a tool rests in its own hole with less force than on elements.
  static constexpr double kCrossingsPerRadius = 2.05;
  /// Largest yield of the contact on a plane [spacings]. It bounds how far the drawn tool sinks in. With a fifth more,
  /// a ball sinks by more than a voxel into a wall of 1.5 voxels.
  static constexpr double kMaxYield = 0.33;
  /// Largest yield as a fraction of the tip's radius: `BallOnPlane` is a law for depths well below the radius.
  static constexpr double kMaxYieldOfRadius = 0.25;
  /// Largest yield as a fraction of the coupling's extension at the largest force. A contact softer than the coupling
  /// could not be compensated.
  static constexpr double kMaxYieldOfExtension = 0.25;
  /// Width of a point's cell [spacings], over which the foundation's law takes its mean.
  static constexpr double kPointCell = 0.5;
  /// Ratio of longest to shortest spacing from which elements lie askew. Their diagonals are longer by this factor, so
  /// they get as many more points.
  static constexpr double kSkewed = 1.5;
  /// Rounding that does not add a point to an element's side.
  static constexpr double kSideRounding = 1e-9;

  // --- Coupling: the compensated spring (springs.hpp).

  /// ε: fraction of the compliance 1/k that the spring keeps at small forces, so that it stays 1/ε times k at most.
  /// A smaller ε reaches the stated stiffness at smaller forces, with a stiffer spring to solve for.
  static constexpr double kMinCompliance = 0.25;
  /// Bisections for δ_c at construction: 2⁻⁶⁰ of the yield is below the rounding of a double.
  static constexpr int kBisections = 60;
  /// Intervals of a table of depths, from which Newton's method for the depth of an extension starts. One or two steps
  /// remain.
  static constexpr std::size_t kSpringIntervals = 64;
  /// Newton steps for that depth, at most. They converge quadratically in a few.
  static constexpr int kMaxSpringSteps = 20;
  /// A relative step below this ends them: its square, the remaining error, is the rounding of a double.
  static constexpr double kSpringRoot = 1e-8;
  /// Rotations below this [rad] use the limit 1 of (φ/2) cot (φ/2), which is exact to φ²/12 = 1e-9.
  static constexpr double kSmallRotation = 1e-4;

  // --- Pose search: Newton steps on the energy (pose_search.hpp).

  /// Newton steps a tick, at most. The rest is carried on at the next tick (`Status::kWorkBound`).
  static constexpr int kMaxSteps = 24;
  /// No step starts after more evaluations than this in a tick.
  static constexpr int kMaxEvaluations = 64;
  /// Trials of one line search, at most.
  static constexpr int kMaxTrials = 8;
  /// Newton steps on the linear model with friction, at most, within one step of the search.
  static constexpr int kMaxFrictionSteps = 6;
  /// Step that ends a search at any device motion [spacings]: some 0.3 nm, 0.2 µN at 800 N/m.
  static constexpr double kSmallestStep = 1e-6;
  /// A search ends where its next step would be below this fraction of the device's motion in the tick. A larger
  /// fraction makes ticks shorter and leaves a larger lag of force. With friction that step is less than predicted, in
  /// the median .4 of it.
  static constexpr double kMotionFraction = 0.04;
  /// Device motion in a tick counts as at most this [spacings], so that fast motion does not loosen the tolerance.
  static constexpr double kMaxCountedMotion = 0.5;
  /// Largest uphill slope of the energy at the end of a line search, as a fraction of the slope at its start.
  static constexpr double kUphillSlope = 0.5;
  /// Steepest downhill slope there, likewise: the curvature condition of Wolfe. A steeper one extends the step.
  static constexpr double kDownhillSlope = 0.9;
  /// Factor by which a line search extends a step.
  static constexpr double kStepGrowth = 2;
  /// A trial inside a bracket keeps this fraction of the bracket from either end. Without it the secant may stall.
  static constexpr double kBracketMargin = 0.1;
  /// Steps of the fixed point where contact and coupling balance on a line.
  static constexpr int kBalanceSteps = 3;
  /// Relative increase of the energy that counts as rounding.
  static constexpr double kEnergyRounding = 1e-9;
  /// Fraction of the core's radius by which a step may move a part of the tool past its known clearance. Below 1, no
  /// surface passes the tool's axis, where the contact normal changes sign.
  static constexpr double kCoreFraction = 0.5;

  // --- Start and jump (coupled_tool_renderer.hpp, tool_in_bone.hpp).

  /// After a cut a search starts ahead of the last pose by at most this [spacings], and by a step's fraction of the
  /// core's radius.
  static constexpr double kMaxStartAhead = 0.5;
  /// A device whose axis turned farther between two ticks jumped [rad]. Hands turn more slowly, even at 60 Hz.
  static constexpr double kJumpAngle = 0.5;
  /// A tool that appears with bone deeper in it than this [spacings] started in contact. Less is grazing.
  static constexpr double kStartDepth = 0.1;
  /// Samples along the tool's axis, at most: they bound the work for tools of a thousand voxels.
  static constexpr int kMaxAxisSamples = 1000;

  /// Speed at which the drawn tool catches up with the virtual one, besides the device's motion [m/s]. A tool that
  /// snaps by a millimetre is there in 10 ms, within a picture.
  static constexpr double kDrawnSpeed = 0.1;

  /// Lever at which a turn counts as a motion for the bound on the wrench's change, where the coupling has no spring
  /// for rotation [m]: as far as fingers hold a drill from its tip.
  static constexpr double kHandLever = 0.03;

  // --- Broad phase (broad_phase.hpp, element_list.hpp).

  /// A list of elements reaches as far as the tool moves in so many ticks. A longer reach makes lists less often, and
  /// measures more elements.
  static constexpr double kReachTicks = 3;
  /// Bounds of that reach beyond the tool [spacings]; at each level of elements (`ElementSize`) the least doubles.
  static constexpr double kMinReach = 0.5, kMaxReach = 4;
  /// Likewise for rotations of the tool's axis [rad].
  static constexpr double kMinReachAngle = 0.02, kMaxReachAngle = 0.1;
  /// Additional reach for bricks [spacings], so that a list of bricks serves many lists of elements.
  static constexpr double kBrickReach = 12;
  /// Likewise for rotations of the tool's axis [rad].
  static constexpr double kBrickReachAngle = 0.2;
  /// Elements reach beyond the brick of their edges by less than this many longest spacings.
  static constexpr int kElementReach = 2;

  // --- Narrow phase and contacts (foundation.hpp, bristles.hpp).

  /// Points nearer than this outside the tool [m] are evaluated in double precision: single precision errs by less.
  static constexpr float kSinglePrecision = 1e-8F;
  /// Nearer to the axis than this [m] a point has no radial direction, and gets the tool's x axis.
  static constexpr double kOnAxis = 1e-9;
  /// A slipping bristle within this fraction of its limit still slips: rounding puts it on either side.
  static constexpr double kSlipMargin = 1e-6;
  /// Room for contact points, and for elements in contact. Those beyond it press, but have no friction and are not in
  /// `contacts()` (`CoupledToolRenderer::unlisted_force`).
  static constexpr std::size_t kMaxPoints = 16384, kMaxContacts = 2048;
};

}  // namespace trephine
