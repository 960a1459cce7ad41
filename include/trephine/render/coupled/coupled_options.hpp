// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

struct CoupledOptions {
  /// k_v [N/m]: stiffness that the hand feels when the tip is pressed on bone. Take as much as the device allows at its
  /// rate.
  double stiffness = 800;
  /// k_θ [N·m/rad]. Infinity is for translation alone: the virtual tool has the device's rotation, and the torque is
  /// zero.
  double rotational_stiffness = 0.3;
  double force = 8.5;  ///< largest force of the coupling [N]: the device's maximum
  /// Likewise, the torque [N·m]. 0 is for devices without motors for torque: translation alone, as with an infinite
  /// `rotational_stiffness`.
  double torque = 0.188;
  /// Fastest change of the force besides `stiffness` times the device's motion [N/s], in a scene; infinity for no bound
  /// (`ReleaseBound`). So a film that breaks lets the hand through in some ticks, and not in one, and a ball that snaps
  /// past an edge turns the force in some.
  double release = 60;
  /// A device that moved farther than this between two ticks [m], or whose axis turned by half a radian, is elsewhere.
  /// The virtual tool then starts at the new pose if its axis is free of bone there. Otherwise it follows step by step.
  double jump = 0.005;
  /// A burr that only touches bone removes nothing, so the cutting pose lies ahead of the virtual tool, toward the
  /// device, by at most this many voxels (shortest spacings). A cut at once (`GeometricCut`) removes all of that, so
  /// for it this is a speed, in voxels a millisecond: the same at any tick rate. For a cut in time, which has a rate
  /// of its own, it is a length.
  double bite = 1;
  static constexpr double kBiteTime = 1e-3;      ///< in which a cut at once takes off `bite` voxels [s]
  static constexpr double kPressureBite = 0.15;  ///< share of `bite` by which a cut by pressure lies ahead

  /// Upper bound of each gain in its unit: squares of values derived from it are finite in single precision.
  static constexpr double kMaxGain = 1e12;

  /// True if the coupling has a spring for rotation, and so a torque.
  [[nodiscard]] bool has_torque() const noexcept { return torque > 0 && is_finite(rotational_stiffness); }

  /// Throws std::invalid_argument for a value out of its range.
  void validate() const {
    const auto positive = [](double v) { return v > 0 && v <= kMaxGain; };
    if (!positive(stiffness)) refuse("CoupledOptions", "stiffness must be > 0 and at most 1e12 N/m", stiffness);
    if (!positive(rotational_stiffness) && !(rotational_stiffness > 0 && !is_finite(rotational_stiffness)))
      refuse("CoupledOptions", "rotational_stiffness must be > 0 and at most 1e12 N·m/rad, or infinite",
             rotational_stiffness);
    if (!positive(force)) refuse("CoupledOptions", "force must be > 0 and at most 1e12 N", force);
    if (!(torque >= 0 && torque <= kMaxGain)) refuse("CoupledOptions", "torque must be 0 to 1e12 N·m", torque);
    if (!(release > 0)) refuse("CoupledOptions", "release must be > 0 N/s", release);
    if (!(jump > 0)) refuse("CoupledOptions", "jump must be > 0 m", jump);
    if (!(bite >= 0 && bite <= 2)) refuse("CoupledOptions", "bite must be 0 to 2 voxels", bite);
  }
};

}  // namespace trephine
