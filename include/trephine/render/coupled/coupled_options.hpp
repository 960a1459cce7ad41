// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>

#include <cmath>
#include <concepts>

/// What a coupled tool is told.
namespace trephine {

struct CoupledOptions {
  /// k_v [N/m]: the stiffness that the hand feels when the tip is pressed on bone. As high as the device allows at its
  /// rate.
  double stiffness = 800;
  /// k_θ [N·m/rad]. Infinite: the tool's rotation is the device's, and the torque zero, as with `TranslationOnly`.
  double rotational_stiffness = 0.3;
  double force = 8.5;     ///< most that the coupling pulls with [N]: the device's maximum
  double torque = 0.188;  ///< likewise [N·m]
  /// The device's pose moved farther than this between two ticks [m], or its axis turned by half a radian: it jumped.
  /// The virtual tool appears at the new pose where that is free of bone, and follows step by step where it is not.
  double jump = 0.005;
  /// A burr that only touches removes nothing. Carving follows the virtual tool pushed on toward the device's pose by
  /// as much as that is ahead, at most by this many voxels (shortest spacings). A cut at once (`GeometricCut`) takes
  /// all of that off, so for it this is a speed, in voxels a millisecond: the same at any tick rate. A cut in time has
  /// a rate of its own, and this is a length.
  double bite = 1;
  static constexpr double kBiteTime = 1e-3;  ///< in which a cut at once takes off `bite` voxels [s]

  static constexpr double kMost = 1e12;  ///< of each gain: squares of what follows from it are single precision's

  void validate() const {
    const auto positive = [](double v) { return v > 0 && v <= kMost; };
    if (!positive(stiffness)) refuse("CoupledOptions", "stiffness must be > 0 and at most 1e12 N/m", stiffness);
    if (!positive(rotational_stiffness) && !(rotational_stiffness > 0 && std::isinf(rotational_stiffness)))
      refuse("CoupledOptions", "rotational_stiffness must be > 0 and at most 1e12 N·m/rad, or infinite",
             rotational_stiffness);
    if (!positive(force)) refuse("CoupledOptions", "force must be > 0 and at most 1e12 N", force);
    if (!positive(torque)) refuse("CoupledOptions", "torque must be > 0 and at most 1e12 N·m", torque);
    if (!(jump > 0)) refuse("CoupledOptions", "jump must be > 0 m", jump);
    if (!(bite >= 0 && bite <= 2)) refuse("CoupledOptions", "bite must be 0 to 2 voxels", bite);
  }
};

/// Which of its motions the virtual tool finds by itself. A device without motors for torque needs no more than
/// translation: the tool's rotation is then the device's, and the torque zero.
struct SixDof {
  static constexpr int kDof = 6;
};
struct TranslationOnly {
  static constexpr int kDof = 3;
};
template <class M>
concept CoupledMotion = std::same_as<M, SixDof> || std::same_as<M, TranslationOnly>;

}  // namespace trephine
