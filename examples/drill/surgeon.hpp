// SPDX-License-Identifier: MIT
#pragma once

#include "spot.hpp"

#include <trephine/device/simulated_device.hpp>

#include <array>

namespace drill {

/// The simulated surgeon's hand: where it wants the drill at each moment. A spring and a damper hold the drill to it,
/// so forces decide where the drill really goes. Over the run it approaches, mills a hole with the tip, stops the
/// spindle and goes in to the ground, leans the shaft on the rim, turns round the hole, straightens up and withdraws.
class Surgeon {
 public:
  enum Phase { kApproach, kMill, kGoIn, kLean, kHold, kTurn, kStraighten, kWithdraw, kPhases };

  struct Plan {
    double seconds = 8;       ///< length of the whole run, > 0
    double hole_depth = 1.2;  ///< of the burr's centre below the surface after milling, in burr radii
    double lean = 0.70;       ///< [rad]; the rim stops the shaft before
  };

  Surgeon(const Spot& spot, const trephine::Burr& burr, const Plan& plan);

  [[nodiscard]] trephine::HandTarget operator()(double time) const noexcept;

  /// When a phase ends [s].
  [[nodiscard]] double ends(Phase phase) const noexcept;
  [[nodiscard]] double seconds() const noexcept { return plan_.seconds; }
  /// Depth of the burr's centre under the surface at the end of milling, as wanted [m].
  [[nodiscard]] double hole_depth() const noexcept { return depth_; }
  /// Columns: the way the shaft leans first, the way across, outward; the drill's attitude at the start, in W.
  [[nodiscard]] const trephine::Mat3d& frame_W() const noexcept { return R_; }
  [[nodiscard]] const Spot& spot() const noexcept { return spot_; }

 private:
  [[nodiscard]] trephine::Posed pose(double height, double lean, double around) const noexcept;

  Spot spot_;
  double radius_;
  Plan plan_;
  double depth_;
  trephine::Mat3d R_;
};

}  // namespace drill
