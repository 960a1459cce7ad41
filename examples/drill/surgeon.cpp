// SPDX-License-Identifier: MIT
#include "surgeon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace drill {
namespace {

using trephine::Mat3d;
using trephine::Vec3d;

/// Shares of the run at which the phases end.
constexpr std::array<double, Surgeon::kPhases> kEnds{0.10, 0.46, 0.54, 0.66, 0.70, 0.88, 0.93, 1.0};

constexpr double kStartHeight = 5;  // of the burr's centre over the surface, in burr radii
constexpr double kGround = 1.6;     // and how much deeper the hand then wants it: it presses on the ground
constexpr double kTurnAngle = 1.25 * std::numbers::pi;

double eased(double s) noexcept {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

/// An outward frame whose lean is level rather than up or down, where there is an up.
Mat3d frame(const Vec3d& n) {
  Vec3d u = Vec3d::UnitZ().cross(n);
  if (u.norm() < 0.2) u = Vec3d::UnitX() - n.x() * n;
  Mat3d R;
  R.col(0) = u.normalized();
  R.col(1) = n.cross(R.col(0));
  R.col(2) = n;
  return R;
}

}  // namespace

Surgeon::Surgeon(const Spot& spot, const trephine::Burr& burr, const Plan& plan)
    : spot_(spot),
      radius_(burr.tip_radius),
      plan_(plan),
      // Some bone stays below where the spot has any: the ball's lower half needs a radius, the ground half of one.
      depth_(std::clamp(spot.depth - 1.5 * radius_, 0.6 * radius_, plan.hole_depth * radius_)),
      R_(frame(spot.normal_W)) {}

double Surgeon::ends(Phase phase) const noexcept { return plan_.seconds * kEnds[static_cast<std::size_t>(phase)]; }

trephine::Posed Surgeon::pose(double height, double lean, double around) const noexcept {
  const Vec3d way(std::cos(around), std::sin(around), 0);
  const Mat3d tilt = trephine::rotation_from_vector<double>(lean * Vec3d(-way.y(), way.x(), 0));
  return trephine::make_pose<double>(R_ * tilt, spot_.p_W + height * spot_.normal_W);
}

trephine::HandTarget Surgeon::operator()(double time) const noexcept {
  const auto share = [&](Phase phase) {
    const double from = phase == kApproach ? 0.0 : ends(static_cast<Phase>(phase - 1));
    return (time - from) / (ends(phase) - from);
  };
  const double above = kStartHeight * radius_;
  const double touching = 1.2 * radius_;
  const double ground = -depth_ - kGround * radius_;
  // Milling goes on evenly; everything else starts and stops gently.
  double height = above + (touching - above) * eased(share(kApproach));
  if (time > ends(kApproach)) height = touching + (-depth_ - touching) * std::min(share(kMill) / 0.92, 1.0);
  if (time > ends(kMill)) height = -depth_ + (ground + depth_) * eased(share(kGoIn));
  if (time > ends(kTurn)) height = ground + (-depth_ - ground) * eased(share(kStraighten));
  if (time > ends(kStraighten)) height = -depth_ + (above + depth_) * eased(share(kWithdraw));
  const double lean = plan_.lean * (eased(share(kLean)) - eased(share(kStraighten)));
  const double around = kTurnAngle * eased(share(kTurn));
  const bool spindle = time > 0.5 * ends(kApproach) && time <= ends(kMill);
  return {pose(height, lean, around), spindle ? 1U : 0U};
}

}  // namespace drill
