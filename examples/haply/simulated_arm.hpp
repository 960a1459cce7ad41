// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/rotation.hpp>
#include <trephine/device/simulated_device.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

namespace haply {

/// The hand that holds the simulated arm, in D: every eight seconds it comes down by 20 mm, presses button a, and goes
/// up, on a circle of 4 mm whose constant speed lets a frozen state be told from rest. The handle stands upright, its
/// +y down, and leans slowly to and fro.
struct SimulatedHand {
  bool moves = true;

  [[nodiscard]] static trephine::Vec3d home() { return {0.05, -0.15, 0.15}; }

  trephine::HandTarget operator()(double time) const noexcept {
    const double t = std::fmod(time, 8.0);
    const double depth = moves ? 0.02 * std::clamp(std::min(t / 3, (8 - t) / 2), 0.0, 1.0) : 0.0;
    trephine::Posed X_DH = trephine::Posed::Identity();
    constexpr double kRadius = 0.002, kTurns = 8;  // [m, rad/s]
    X_DH.translation() = home() - trephine::Vec3d(0, 0, depth);
    if (moves) X_DH.translation() += kRadius * trephine::Vec3d(std::cos(kTurns * t) - 1, std::sin(kTurns * t), 0);
    const double lean = moves ? 0.1 * std::sin(time) : 0.0;
    constexpr double kUpright = -1.5707963267948966;  // about x: +y points down
    X_DH.linear() = trephine::rotation_from_vector<double>(trephine::Vec3d(0, lean, 0)) *
                    trephine::rotation_from_vector<double>(trephine::Vec3d(kUpright, 0, 0));
    return {X_DH, moves && t > 2 && t < 6.5 ? 1U : 0U};
  }
};

/// A mass on the hand's spring, with damping. Equal sequences of calls give equal bits: its time is the number of
/// steps.
class SimulatedArm {
 public:
  static constexpr double kStep = 0.25e-3;                        ///< [s]
  static constexpr double kRadioRate = 55;                        ///< of the handle's rotation [Hz]
  using Hand = std::function<trephine::HandTarget(double time)>;  ///< in D

  explicit SimulatedArm(Hand hand)
      : hand_(std::move(hand)), device_(options(hand_(0).X_DH), [this](double time) { return target_ = hand_(time); }) {
    sample();
  }
  SimulatedArm(const SimulatedArm&) = delete;
  SimulatedArm& operator=(const SimulatedArm&) = delete;

  /// Simulates one step under a force [N].
  void step(const trephine::Vec3d& force) {
    (void)device_.write({force, trephine::Vec3d::Zero()});
    device_.advance(kStep);
    const double before = std::floor(time() * kRadioRate);
    ++steps_;
    if (std::floor(time() * kRadioRate) > before) sample();
  }

  [[nodiscard]] double time() const { return kStep * static_cast<double>(steps_); }
  [[nodiscard]] std::uint64_t steps() const { return steps_; }
  [[nodiscard]] trephine::Vec3d position() const { return device_.X_DH().translation(); }
  [[nodiscard]] trephine::Vec3d velocity() const { return device_.velocity().linear; }
  /// As the radio of the handle sampled it last.
  [[nodiscard]] const trephine::Quatd& rotation() const { return sampled_; }
  [[nodiscard]] std::uint32_t buttons() const { return target_.buttons; }

 private:
  static trephine::SimulatedDeviceOptions options(const trephine::Posed& X_DH) {
    trephine::SimulatedDeviceOptions o;
    o.linear = {.inertia = 0.15, .damping = 0.5, .friction = 0, .quantum = 0, .limit = 10};
    o.output_dof = 3;
    o.substeps = 1;
    o.X_DH = X_DH;
    return o;
  }
  void sample() { sampled_ = trephine::Quatd(target_.X_DH.linear()); }

  Hand hand_;
  trephine::HandTarget target_;
  trephine::Quatd sampled_ = trephine::Quatd::Identity();
  trephine::SimulatedDevice<Hand> device_;
  std::uint64_t steps_ = 0;
};

}  // namespace haply
