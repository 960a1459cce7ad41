// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>

#include <concepts>
#include <cstdint>

/// A 6-DOF mouse (the free spacenav driver's kind): a cap that springs back, whose deflection is a speed. Parts that
/// know nothing of libspnav.
namespace spacemouse {

/// Deflection of the cap in the driver's counts (about ±350 at the stop, with its default sensitivity) and axes: x
/// right, y up, z away from the user, and turns about each.
struct Deflection {
  int x = 0, y = 0, z = 0;
  int rx = 0, ry = 0, rz = 0;
};

/// What the driver reports, one at a time. A deflection holds until the next one.
struct Event {
  enum Kind { kNone, kMotion, kButton, kLost } kind = kNone;
  Deflection deflection{};  ///< kMotion
  int button = 0;           ///< kButton
  bool pressed = false;     ///< kButton
};

/// Where events come from. `next` never waits: kNone when there is no more now, kLost when the driver is gone.
template <class S>
concept EventSource = requires(S& source) {
  { source.next() } noexcept -> std::same_as<Event>;
};

/// How fast full deflection moves the tool.
struct Gains {
  double speed = 0.05;  ///< [m/s] at `full`
  double turn = 1.0;    ///< [rad/s] at `full`
  double full = 350;    ///< counts
  double dead = 5;      ///< counts that mean rest, per axis
};

/// Integrates deflections to a pose in D: x right, y up, z toward the user, right-handed. Translation is along D's
/// axes, rotation about them through the tool point, so that the tool moves as the cap is pushed whichever way it
/// points.
class RateIntegrator {
 public:
  explicit RateIntegrator(const Gains& gains, const trephine::Posed& X_DH = trephine::Posed::Identity()) noexcept
      : gains_(gains), X_DH_(X_DH) {}

  void deflect(const Deflection& d) noexcept {
    // The driver's z points the other way, in turns as in moves: so libspnav's own helper for moving objects has it.
    v_ = gains_.speed / gains_.full * trephine::Vec3d(alive(d.x), alive(d.y), -alive(d.z));
    w_ = gains_.turn / gains_.full * trephine::Vec3d(alive(d.rx), alive(d.ry), -alive(d.rz));
  }

  /// Lets dt [s] pass.
  void advance(double dt) noexcept {
    X_DH_.translation() += dt * v_;
    const trephine::Mat3d R = trephine::rotation_from_vector<double>(dt * w_) * X_DH_.linear();
    X_DH_.linear() = trephine::Quatd(R).normalized().toRotationMatrix();
  }

  [[nodiscard]] const trephine::Posed& pose() const noexcept { return X_DH_; }

 private:
  [[nodiscard]] double alive(int counts) const noexcept {
    return counts > gains_.dead || counts < -gains_.dead ? counts : 0.0;
  }

  Gains gains_;
  trephine::Posed X_DH_;
  trephine::Vec3d v_ = trephine::Vec3d::Zero();
  trephine::Vec3d w_ = trephine::Vec3d::Zero();
};

}  // namespace spacemouse
