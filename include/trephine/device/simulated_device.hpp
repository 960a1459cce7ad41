// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/device/device.hpp>
#include <trephine/device/simulated_axes.hpp>

#include <array>
#include <concepts>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Mechanics of the simulated device in translation or rotation. Units: [linear | angular].
struct DeviceAxes {
  double inertia = 0;   ///< apparent, isotropic [kg | kg·m²]
  double damping = 0;   ///< viscous [N·s/m | N·m·s/rad]
  double friction = 0;  ///< Coulomb, equal for stiction and sliding [N | N·m]
  double quantum = 0;   ///< resolution of the encoders, per component; 0: continuous [m | rad]
  double limit = 0;     ///< largest output of the motors, as a vector's length; 0: no limit [N | N·m]
};

/// Mechanics of the simulated hand: a mass rigidly on the handle, a spring to the scripted target, and a damper to
/// ground. With a stiffness of 0 no hand holds the device.
struct HandAxes {
  double inertia = 0;    ///< [kg | kg·m²]
  double damping = 0;    ///< [N·s/m | N·m·s/rad]
  double stiffness = 0;  ///< [N/m | N·m/rad]
};

/// Target of the hand at a moment: pose of the handle and pressed buttons. A script may return a pose alone.
struct HandTarget {
  Posed X_DH = Posed::Identity();
  std::uint32_t buttons = 0;

  HandTarget() = default;
  HandTarget(const Posed& X, std::uint32_t buttons_down = 0) : X_DH(X), buttons(buttons_down) {}
};

/// A script of the hand: a function of the time [s] since construction of the device. It is called at the middle of
/// every substep, so it should be cheap.
template <class S>
concept HandScript = requires(S& script, double time) {
  { script(time) } -> std::convertible_to<HandTarget>;
};

/// A hand that holds the device's start pose.
struct StillHand {
  Posed X_DH = Posed::Identity();
  HandTarget operator()(double) const noexcept { return X_DH; }
};

/// Options of a simulated device and hand. The defaults are orders of magnitude for a desktop device of the Touch class
/// in a light grip, not the model of a product.
struct SimulatedDeviceOptions {
  DeviceAxes linear{.inertia = 0.045, .damping = 0.5, .friction = 0.05, .quantum = 0.055e-3, .limit = 3.3};
  DeviceAxes angular{.inertia = 4e-5, .damping = 4e-4, .friction = 0, .quantum = 1e-4, .limit = 0.2};
  HandAxes hand_linear{.inertia = 0.04, .damping = 8.0, .stiffness = 400};
  HandAxes hand_angular{.inertia = 4e-5, .damping = 8e-3, .stiffness = 0.4};
  int output_dof = 6;   ///< 0, 3 or 6
  int delay_ticks = 0;  ///< writes between a command and its effect, 0 to 8
  int substeps = 20;    ///< per tick; without friction and with a still hand the result does not depend on it
  double rate = 1000;   ///< nominal rate in `capabilities` [Hz]; the owner may advance the device at any rate
  Posed X_DH = Posed::Identity();  ///< start pose of the handle, at rest
};

/// Simulates a haptic device and the hand that holds it, for closed-loop tests and for running without hardware:
///
///     (m + m_h) ẍ + (b + b_h) ẋ + k_h (x − x_d(t)) = F − f_c ẋ/|ẋ|
///
/// and the same equation for rotation. F is the command held over the tick (a zero-order hold), delayed by
/// `delay_ticks` writes and saturated. Integration is exact within substeps, over which only the hand's target and the
/// direction of friction are held. Rotation is exact about a fixed axis. The isotropic inertia has no gyroscopic term,
/// and rotation vectors are added in the D frame per substep.
///
/// The owner drives the device: `read` returns the quantised present pose, `write` sets the command, and `advance(dt)`
/// simulates dt seconds. Deterministic; allocates nothing after construction. One thread at a time. For a non-finite
/// command `write` returns kFault and commands zero, so it never reaches the state.
template <HandScript Script = StillHand>
class SimulatedDevice {
 public:
  static constexpr int kMaxDelayTicks = 8;  ///< length of the command queue: 8 ms at 1 kHz

  /// Throws std::invalid_argument if an option is out of range.
  explicit SimulatedDevice(const SimulatedDeviceOptions& options = {})
    requires std::same_as<Script, StillHand>
      : SimulatedDevice(options, StillHand{options.X_DH}) {}

  SimulatedDevice(const SimulatedDeviceOptions& options, Script script)
      : options_(validated(options)),
        script_(std::move(script)),
        p_DH_(options.X_DH.translation()),
        q_DH_(Quatd(options.X_DH.linear()).normalized()) {
    const HandTarget target = script_(0.0);
    buttons_ = target.buttons;
  }

  [[nodiscard]] DeviceCapabilities capabilities() const {
    const double hold = (0.5 + options_.delay_ticks) / options_.rate;
    return {.name = "simulated device",
            .input_dof = 6,
            .output_dof = options_.output_dof,
            .max_force = options_.linear.limit,
            .max_torque = options_.angular.limit,
            .stiffness = options_.linear.damping / hold,
            .angular_stiffness = options_.angular.damping / hold,
            .rate = options_.rate};
  }

  [[nodiscard]] DeviceStatus read(DeviceState& state) noexcept {
    const Vec3d p = simulated::quantised(p_DH_, options_.linear.quantum);
    Mat3d R = q_DH_.toRotationMatrix();
    if (options_.angular.quantum > 0)
      R = rotation_from_vector(simulated::quantised(rotation_vector(R), options_.angular.quantum));
    state = {.X_DH = make_pose(R, p), .buttons = buttons_, .time = std::nullopt};
    return is_finite(p) && is_finite(R) ? DeviceStatus::kOk : DeviceStatus::kFault;
  }

  DeviceStatus write(const Wrenchd& wrench_H_D) noexcept {
    const bool finite = is_finite(wrench_H_D);
    Wrenchd command;
    if (finite && options_.output_dof >= 3)
      command.force = simulated::saturated(wrench_H_D.force, options_.linear.limit);
    if (finite && options_.output_dof == 6)
      command.torque = simulated::saturated(wrench_H_D.torque, options_.angular.limit);
    const auto delay = static_cast<std::size_t>(options_.delay_ticks);
    for (std::size_t i = 0; i < delay; ++i) queue_[i] = finite ? queue_[i + 1] : Wrenchd::zero();
    queue_[delay] = command;
    return finite ? DeviceStatus::kOk : DeviceStatus::kFault;
  }

  /// Simulates `dt` [s] under the command in effect; does nothing unless dt is > 0 and finite. Throws exceptions of the
  /// script.
  void advance(double dt) {
    if (!(dt > 0) || !is_finite(dt)) return;
    if (dt != prepared_dt_) prepare(dt);
    const double h = dt / options_.substeps;
    for (int i = 0; i < options_.substeps; ++i) {
      const HandTarget target = script_(time_ + (i + 0.5) * h);
      translate(target);
      rotate(target);
    }
    time_ += dt;
    const HandTarget target = script_(time_);
    buttons_ = target.buttons;
  }

  /// Return the true state, for measurements: unquantised pose, velocity of H and angular velocity in D axes [m/s,
  /// rad/s], present wrench of the motors (delayed, saturated) and simulated time [s].
  [[nodiscard]] Posed X_DH() const noexcept { return make_pose(Mat3d(q_DH_), p_DH_); }
  [[nodiscard]] Twist velocity() const noexcept { return {v_, w_}; }
  [[nodiscard]] const Wrenchd& applied() const noexcept { return queue_[0]; }
  [[nodiscard]] double time() const noexcept { return time_; }
  [[nodiscard]] const SimulatedDeviceOptions& options() const noexcept { return options_; }

 private:
  static SimulatedDeviceOptions validated(const SimulatedDeviceOptions& options) {
    const auto check_value = [](double value, bool positive, const char* rule) {
      if (!(positive ? value > 0 : value >= 0) || !is_finite(value)) refuse("SimulatedDevice", rule, value);
    };
    for (const DeviceAxes& axes : {options.linear, options.angular}) {
      check_value(axes.inertia, true, "inertia must be > 0 and finite");
      check_value(axes.damping, false, "damping must be >= 0 and finite");
      check_value(axes.friction, false, "friction must be >= 0 and finite");
      check_value(axes.quantum, false, "quantum must be >= 0 and finite");
      check_value(axes.limit, false, "limit must be >= 0 and finite (0: none)");
    }
    for (const HandAxes& hand : {options.hand_linear, options.hand_angular}) {
      check_value(hand.inertia, false, "the hand's inertia must be >= 0 and finite");
      check_value(hand.damping, false, "the hand's damping must be >= 0 and finite");
      check_value(hand.stiffness, false, "the hand's stiffness must be >= 0 and finite");
    }
    check_value(options.rate, true, "rate must be > 0 Hz and finite");
    const int dof = options.output_dof;
    if (dof != 0 && dof != 3 && dof != 6) refuse("SimulatedDevice", "output_dof must be 0, 3 or 6", dof);
    if (options.delay_ticks < 0 || options.delay_ticks > kMaxDelayTicks)
      refuse("SimulatedDevice", "delay_ticks must be in 0..8", options.delay_ticks);
    if (options.substeps < 1) refuse("SimulatedDevice", "substeps must be >= 1", options.substeps);
    if (!is_finite(options.X_DH)) refuse("SimulatedDevice", "X_DH must be finite", options.X_DH.matrix());
    return options;
  }

  void prepare(double dt) noexcept {
    const double h = dt / options_.substeps;
    const auto step = [h](const DeviceAxes& device, const HandAxes& hand) {
      return simulated::ZeroOrderHoldStep(h, device.inertia + hand.inertia, device.damping + hand.damping,
                                          hand.stiffness);
    };
    linear_step_ = step(options_.linear, options_.hand_linear);
    angular_step_ = step(options_.angular, options_.hand_angular);
    prepared_dt_ = dt;
  }

  void translate(const HandTarget& target) noexcept {
    const double k = options_.hand_linear.stiffness;
    const Vec3d e = k > 0 ? Vec3d(p_DH_ - target.X_DH.translation()) : Vec3d::Zero();
    p_DH_ += simulated::substep(linear_step_, k, options_.linear.friction, e, v_, applied().force);
  }

  void rotate(const HandTarget& target) noexcept {
    const double k = options_.hand_angular.stiffness;
    const Mat3d R_DH = q_DH_.toRotationMatrix();
    const Vec3d e = k > 0 ? rotation_vector<double>(R_DH * target.X_DH.linear().transpose()) : Vec3d::Zero();
    const Vec3d rotation = simulated::substep(angular_step_, k, options_.angular.friction, e, w_, applied().torque);
    if (rotation.squaredNorm() > 0) q_DH_ = (Quatd(rotation_from_vector(rotation)) * q_DH_).normalized();
  }

  SimulatedDeviceOptions options_;
  Script script_;
  Vec3d p_DH_;
  Quatd q_DH_;
  Vec3d v_ = Vec3d::Zero();
  Vec3d w_ = Vec3d::Zero();
  std::array<Wrenchd, kMaxDelayTicks + 1> queue_{};  // commands: [0] is in effect, [delay] the last written
  std::uint32_t buttons_ = 0;
  double time_ = 0;
  double prepared_dt_ = 0;
  simulated::ZeroOrderHoldStep linear_step_;
  simulated::ZeroOrderHoldStep angular_step_;
};

SimulatedDevice(const SimulatedDeviceOptions&) -> SimulatedDevice<StillHand>;
SimulatedDevice() -> SimulatedDevice<StillHand>;

}  // namespace trephine
