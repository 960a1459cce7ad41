// SPDX-License-Identifier: MIT
#pragma once

#include "orbit_camera.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/device/registration.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/stage/mailbox.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace live {

/// Where the user wants the drill: the mouse moves this pose, and a spring pulls the simulated device to it. Window
/// thread.
class MouseHand {
 public:
  /// The wish leads the drill by at most this along the view [m]: the hand's spring then pushes with 4 N.
  static constexpr double kMaxLead = 0.010;

  explicit MouseHand(const Posed& X_WT) : X_WT_(X_WT) {}

  [[nodiscard]] const Posed& pose() const { return X_WT_; }
  void set_pose(const Posed& X_WT) { X_WT_ = X_WT; }

  /// Moves parallel to the screen until the tip lies under the pixel.
  void move_under(const OrbitCamera& camera, double x, double y, double width, double height) {
    const ViewRay ray = camera.ray(x, y, width, height);
    const Vec3d back = camera.axes().col(2);
    const double along = (X_WT_.translation() - ray.origin).dot(back) / ray.direction.dot(back);
    if (along > 0) X_WT_.translation() = ray.origin + along * ray.direction;
  }
  /// Moves along the view through the tip, away from the eye by `metres`; not farther ahead of the drill than kMaxLead.
  void push(const OrbitCamera& camera, double metres, const Vec3d& drill_W) {
    const Vec3d along = (X_WT_.translation() - camera.eye_W()).normalized();
    const double lead = (X_WT_.translation() - drill_W).dot(along);
    X_WT_.translation() += std::clamp(metres, std::min(0.0, -kMaxLead - lead), std::max(0.0, kMaxLead - lead)) * along;
  }
  /// Turns the drill about its tip by a drag of the mouse [pixels], about the screen's axes.
  void turn(const OrbitCamera& camera, double dx, double dy, double height) {
    const Mat3d R = camera.axes();
    const double scale = 2.0 / height;
    const Vec3d rotation = scale * (dx * R.col(1) + dy * R.col(0));
    X_WT_.linear() = trephine::rotation_from_vector<double>(rotation) * X_WT_.linear();
  }

 private:
  Posed X_WT_;
};

/// What the window tells the simulated hand.
struct HandWish {
  Posed X_WT = Posed::Identity();
  bool spindle_on = false;
};

/// The script of the simulated hand: it goes where the window wishes, no faster than a hand can. Inbox and registration
/// must outlive it. Haptic thread.
class WishedHand {
 public:
  static constexpr double kFastest = 0.4;      ///< of the wish followed [m/s]
  static constexpr double kFastestTurn = 4.0;  ///< likewise [rad/s]

  WishedHand(trephine::Mailbox<HandWish>& inbox, const trephine::Registration& registration, const Posed& start)
      : inbox_(&inbox), registration_(&registration), target_(start) {
    wish_.X_WT = start;
  }

  trephine::HandTarget operator()(double time) noexcept {
    if (const HandWish* latest = inbox_->take()) wish_ = *latest;
    const double dt = std::max(time - last_, 0.0);
    last_ = time;
    const Vec3d way = wish_.X_WT.translation() - target_.translation();
    target_.translation() += way * std::min(1.0, kFastest * dt / std::max(way.norm(), 1e-12));
    const Vec3d turn = trephine::rotation_vector<double>(wish_.X_WT.linear() * target_.linear().transpose());
    const Vec3d part = turn * std::min(1.0, kFastestTurn * dt / std::max(turn.norm(), 1e-12));
    target_.linear() =
        trephine::Quatd(Mat3d(trephine::rotation_from_vector<double>(part) * target_.linear())).normalized().matrix();
    return {registration_->handle_pose(target_), wish_.spindle_on ? 1U : 0U};
  }

 private:
  trephine::Mailbox<HandWish>* inbox_;
  const trephine::Registration* registration_;
  HandWish wish_;
  Posed target_;
  double last_ = 0;
};

}  // namespace live
