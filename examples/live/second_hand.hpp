// SPDX-License-Identifier: MIT
#pragma once

#include "passing_drill.hpp"

#include <trephine/device/simulated_device.hpp>

namespace live {

/// A suction tube in a simulated second hand, which keeps beside the drill and leans on the bone there. It cuts
/// nothing. Its loop runs in the haptic thread, after the drill's in each period (`trephine::TwoHands`).
class SecondHand {
 public:
  static constexpr bool kHasTorque = true;  // as a scene of a servo loop
  static constexpr double kRadius = 1e-3;   ///< of the tube [m]
  static constexpr double kLength = 0.06;   ///< [m]
  static constexpr double kGap = 1.5e-3;    ///< between tube and burr, to the user's left [m]
  static constexpr double kDeeper = 4e-3;   ///< than the drill's tip [m]: so it leans on bone

  SecondHand(drill::Grid& bone, double isovalue, const Mat3d& R_WU, double burr_radius, const Posed& drill_W)
      : aside_W_(-(burr_radius + kGap + kRadius) * R_WU.col(0)), beside_W_(beside(drill_W)), passing_(bone, isovalue) {
    settings_.burr = {.tip_radius = kRadius, .shaft_radius = kRadius, .shaft_length = kLength};
    settings_.stiffness = 400;
    passing_.take(make_drill(bone, isovalue, settings_, inboxes_), settings_);
  }

  /// The drill is at a pose: the hand goes after it. Haptic thread.
  void follow(const Posed& drill_W) noexcept { beside_W_ = beside(drill_W); }
  void bone_rose() noexcept { passing_.bone_rose(); }

  /// Where the hand wants its tube, as a script of a simulated device whose base is the world.
  [[nodiscard]] auto script() {
    return [this](double) { return trephine::HandTarget(beside_W_); };
  }

  trephine::TickResult tick(const trephine::TickInput& input, double dt) noexcept { return passing_.tick(input, dt); }
  [[nodiscard]] double stiffness() const { return settings_.stiffness; }
  [[nodiscard]] const Posed& tool_W() const noexcept { return passing_.tool_W(); }

 private:
  [[nodiscard]] Posed beside(const Posed& drill_W) const noexcept {
    Posed X = drill_W;
    X.translation() += aside_W_ - kDeeper * drill_W.linear().col(2);
    return X;
  }

  Vec3d aside_W_;
  Posed beside_W_;
  Inboxes inboxes_;
  DrillSettings settings_;
  PassingDrill passing_;
};

}  // namespace live
