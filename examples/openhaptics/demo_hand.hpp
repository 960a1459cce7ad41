// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/spot.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/device/registration.hpp>
#include <trephine/device/simulated_device.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace openhaptics {

/// How a program's workspace lies over a spot of bone.
struct Workspace {
  trephine::Registration registration;
  trephine::Mat3d R_WS;  ///< of the spot: z out of the bone
};

/// The device's base over the spot: its up is out of the bone, its origin (about the middle of its workspace) 10 mm
/// above the surface. The burr is where the driver's position is, the shaft along the stylus. `scale`: how far the
/// drill moves for a metre of the hand.
[[nodiscard]] inline Workspace workspace_over(const drill::Spot& spot, double scale) {
  constexpr double kHeight = 0.010;
  const trephine::Vec3d& n = spot.normal_W;
  const trephine::Vec3d u = n.unitOrthogonal();
  trephine::Mat3d R_WS, R_WD;
  R_WS << u, n.cross(u), n;
  R_WD << u, n, u.cross(n);
  const trephine::Vec3d p_WD = spot.p_W + kHeight * n;
  return {trephine::Registration(trephine::make_pose<double>(R_WD, p_WD), trephine::Posed::Identity(), scale), R_WS};
}

/// The hand that holds a simulated device: again and again it comes down to the spot, drills with a slow feed, stops
/// the spindle, presses and leans on what is left, and goes up. Poses are those of the handle, in D.
class DemoHand {
 public:
  static constexpr double kRound = 10;  // [s]

  DemoHand(const drill::Spot& spot, double tip_radius, const Workspace& workspace)
      : spot_(spot), radius_(tip_radius), workspace_(workspace) {}

  [[nodiscard]] trephine::HandTarget operator()(double time) const noexcept {
    struct Moment {
      double at;      // [s]
      double height;  // of the burr's centre over the surface, in radii
      double lean;    // [rad]
    };
    constexpr std::array<Moment, 7> kMoments{
        {{0, 4, 0}, {1, 1.2, 0}, {5, -0.6, 0}, {6, -4, 0}, {7, -4, 0.35}, {8, -0.6, 0}, {kRound, 4, 0}}};
    const double t = std::fmod(time, kRound);
    std::size_t i = 1;
    while (i + 1 < kMoments.size() && t > kMoments[i].at) ++i;
    const Moment& from = kMoments[i - 1];
    const Moment& to = kMoments[i];
    const double s = std::clamp((t - from.at) / (to.at - from.at), 0.0, 1.0);
    const double height = radius_ * (from.height + s * (to.height - from.height));
    const double lean = from.lean + s * (to.lean - from.lean);
    const trephine::Mat3d R_WT = workspace_.R_WS * trephine::rotation_from_vector<double>(trephine::Vec3d(0, lean, 0));
    const trephine::Vec3d p_WT = spot_.p_W + height * spot_.normal_W;
    const bool spindle = t > 0.5 && t < 5;
    return {workspace_.registration.handle_pose(trephine::make_pose<double>(R_WT, p_WT)), spindle ? 1U : 0U};
  }

 private:
  drill::Spot spot_;
  double radius_;
  Workspace workspace_;
};

}  // namespace openhaptics
