// SPDX-License-Identifier: MIT
#pragma once

#include "force_dimension_errors.hpp"
#include "force_dimension_models.hpp"

#include <trephine/device/device.hpp>
#include <trephine/device/leap.hpp>

#include <dhdc.h>
#include <drdc.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace force_dimension {

/// Bit of a closed gripper in DeviceState::buttons, above the device's own buttons.
inline constexpr std::uint32_t kGripperButton = 1U << 16;

/// Returns the time of a steady clock [s].
inline double steady_seconds() noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct DeviceOptions {
  std::string name{};       ///< as "sigma.7" or "lambda.7 left"; empty: the first device that opens
  bool auto_init = true;    ///< calibrate by the device's own motors, where it can: the handle moves
  double watchdog = 0.008;  ///< the device brakes after this time without a command [s], up to 0.031
  double (*clock)() noexcept = &steady_seconds;
};

/// A Force Dimension device (DHD and DRD) for trephine's servo loop. Not affiliated with Force Dimension.
///
/// D is the base frame of the vendor: X toward the user, Y to the right, Z up; metres, newtons, newton metres. H is the
/// point of the driver's position. A device without a wrist leaves the rotation at identity. Torque goes out on active
/// wrists alone, and the gripper gets no force: its closed state is a button (`kGripperButton`).
///
/// - A call that fails, a pose that is none, or a pose that stays old is a fault; `fault_text` then says what to do.
/// - A device that is uncalibrated, brakes, or was switched off by its button is a safety trip, as are a jump of the
///   pose and a late command. The device brakes by itself at too high a speed, and after `watchdog` without a command.
/// - `write` applies zero after a trip or a fault whatever it is given, and keeps sending: the driver compensates the
///   arm's weight only in the commands of its program.
///
/// Forces that a speed or a late program ended come back when the handle has been slow for a while; forces that a
/// person switched off come back by the same button. Threads: `read` and `write` in one, `trip` and `trips` in any,
/// everything else in the controlling thread. Neither `read` nor `write` locks, allocates or throws.
class Device {
 public:
  // Numbers that decide.
  static constexpr double kOldest = 0.008;  ///< [s] a pose may be old: zero then goes out within 10 ms at 1 kHz
  static constexpr int kStatusEvery = 4;    ///< ticks between looks at the status: 4 ms of a brake at 1 kHz
  static constexpr double kSlow = 0.1;      ///< [m/s] a handle that is held
  static constexpr double kHeld = 0.5;      ///< [s] it must be held before the forces come back
  static constexpr double kClosed = 0.08, kOpened = 0.12;  ///< [rad] of the gripper: closes below, opens above

  /// Opens the device, and calibrates it if it can by itself. Throws std::runtime_error: what, and what to do.
  explicit Device(const DeviceOptions& options = {})
      : options_(options), id_(open_device(options.name)), capabilities_(capabilities_of(id_)) {
    left_ = dhdIsLeftHanded(id_);
    gripper_ = dhdHasGripper(id_);
    fresh_at_ = slow_since_ = options_.clock();
    // Where this fails, `read` trips until a hand has calibrated the device.
    if (!drdIsInitialized(id_) && options_.auto_init && drdIsSupported(id_) && drdAutoInit(id_) >= 0)
      (void)drdStop(true, id_);  // ends the regulation, which would fight the hand
    (void)dhdEnableExpertMode();
    (void)dhdSetWatchdog(static_cast<unsigned char>(std::clamp(options_.watchdog / 125e-6, 1.0, 255.0)), id_);
    (void)dhdDisableExpertMode();
    (void)dhdSetGravityCompensation(DHD_ON, id_);
    (void)send({});
  }
  /// Takes the force off; the device's brakes then let the arm down slowly.
  ~Device() {
    (void)send({});
    (void)dhdEnableForce(DHD_OFF, id_);
    (void)drdClose(id_);
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] trephine::DeviceCapabilities capabilities() const { return capabilities_; }

  [[nodiscard]] trephine::DeviceStatus read(trephine::DeviceState& state) noexcept {
    may_force_ = false;  // until all of this reading is known to be good
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    trephine::Vec3d p(kNone, kNone, kNone);
    double m[3][3] = {{kNone, kNone, kNone}, {kNone, kNone, kNone}, {kNone, kNone, kNone}};
    const int answer = dhdGetPositionAndOrientationFrame(&p.x(), &p.y(), &p.z(), m, id_);
    if (answer < 0) return fault(driver_error());
    const double now = options_.clock();
    bool jumped = false;
    if (answer != DHD_TIMEGUARD || !has_pose_) {  // else the old pose
      trephine::Mat3d R = trephine::Mat3d::Identity();
      if (capabilities_.input_dof == 6)
        R << m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1], m[2][2];
      const trephine::Posed X_DH = trephine::make_pose<double>(R, p);
      if (!is_pose(X_DH)) return fault(kNoPose);
      jumped = has_pose_ && trephine::leaps(X_DH_.translation(), p, now - fresh_at_);
      X_DH_ = X_DH;
      has_pose_ = true;
      fresh_at_ = now;
    } else if (!(now - fresh_at_ <= kOldest)) {
      return fault(kStalePose);
    }
    state.X_DH = X_DH_;
    state.time.reset();
    if (!read_buttons(state.buttons)) return fault(driver_error());
    const Trip before = halt_;
    const int code = follow_status(now);
    if (code != DHD_NO_ERROR) return fault(code);
    faulted_ = false;
    // A trip lasts one tick longer: in that one the pose may still jump to where it is calibrated.
    const Trip why = jumped ? Trip::kJump : halt_ != Trip::kNone ? halt_ : before;
    may_force_ = why == Trip::kNone;
    return report(why);
  }

  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept {
    const bool finite = trephine::is_finite(wrench_H_D);
    const bool late = !(options_.clock() - fresh_at_ <= kOldest);
    trephine::Wrenchd command;
    if (finite && may_force_ && !late) {
      command.force = shortened(wrench_H_D.force, capabilities_.max_force);
      if (capabilities_.output_dof == 6) command.torque = shortened(wrench_H_D.torque, capabilities_.max_torque);
    }
    const bool sent = send(command);
    if (!finite) return fault(kNonFiniteCommand);
    if (!sent) return fault(driver_error());
    return late && may_force_ ? report(Trip::kLate) : trephine::DeviceStatus::kOk;
  }

  /// Returns the last fault and what to do about it. Not in the servo thread.
  [[nodiscard]] std::string fault_text() const { return describe(fault_.load(std::memory_order_relaxed)); }
  /// Returns why there is no force at the moment.
  [[nodiscard]] Trip trip() const noexcept { return trip_.load(std::memory_order_relaxed); }
  /// Returns the count of trips that `read` and `write` reported.
  [[nodiscard]] std::uint64_t trips() const noexcept { return trips_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool left_handed() const noexcept { return left_; }

 private:
  static bool is_pose(const trephine::Posed& X) noexcept {
    constexpr double kSkew = 1e-3;  // far above the rounding of any driver
    if (!trephine::is_finite(X)) return false;
    const trephine::Mat3d R = X.linear();
    return (R * R.transpose() - trephine::Mat3d::Identity()).cwiseAbs().maxCoeff() < kSkew && R.determinant() > 0;
  }

  bool read_buttons(std::uint32_t& buttons) noexcept {
    buttons = dhdGetButtonMask(id_) & (kGripperButton - 1);
    if (!gripper_) return true;
    double angle = 0;
    if (dhdGetGripperAngleRad(&angle, id_) < 0) return false;
    if (left_) angle = -angle;  // a left hand's opens to the negative side
    closed_ = angle < (closed_ ? kOpened : kClosed);
    if (closed_) buttons |= kGripperButton;
    return true;
  }

  /// Looks at the device's state every few ticks, and in each tick of a trip. Returns the code of a fault.
  int follow_status(double now) noexcept {
    if (halt_ == Trip::kNone && ++ticks_since_look_ < kStatusEvery) return DHD_NO_ERROR;
    ticks_since_look_ = 0;
    std::array<int, DHD_MAX_STATUS> s{};
    if (dhdGetStatus(s.data(), id_) < 0) return driver_error();
    if (s[DHD_STATUS_POWER] == 0 || s[DHD_STATUS_CONNECTED] == 0) return kUnpowered;
    if (s[DHD_STATUS_ERROR] != 0) return kDeviceError;
    const bool calibrated = s[DHD_STATUS_RESET] == 0 && drdIsInitialized(id_) &&
                            (capabilities_.input_dof < 6 || s[DHD_STATUS_WRIST_INIT] != 0);
    const bool driven = s[DHD_STATUS_FORCE] != 0 && s[DHD_STATUS_BRAKE] == 0;
    const int cause = s[DHD_STATUS_FORCEOFFCAUSE];
    const bool by_hand = cause == DHD_FORCEOFF_BUTTON || cause == DHD_FORCEOFF_DEADMAN;
    const Trip found = !calibrated ? Trip::kUncalibrated
                       : driven    ? Trip::kNone
                       : by_hand   ? Trip::kButton
                                   : Trip::kBrake;
    if (found != halt_) slow_since_ = now;
    halt_ = found;
    return found == Trip::kBrake && !bring_back(now) ? driver_error() : DHD_NO_ERROR;
  }

  /// Enables the forces once the handle has been held. What goes out then is zero, and the loop ramps it up.
  bool bring_back(double now) noexcept {
    trephine::Vec3d v;
    if (dhdGetLinearVelocity(&v.x(), &v.y(), &v.z(), id_) < 0) return false;
    if (!(v.norm() <= kSlow)) slow_since_ = now;
    return now - slow_since_ < kHeld || dhdEnableForce(DHD_ON, id_) >= 0;
  }

  bool send(const trephine::Wrenchd& w) noexcept {
    return dhdSetForceAndTorqueAndGripperForce(w.force.x(), w.force.y(), w.force.z(), w.torque.x(), w.torque.y(),
                                               w.torque.z(), 0, id_) >= 0;
  }

  /// The first of a row is kept: what follows is often only its consequence.
  trephine::DeviceStatus fault(int code) noexcept {
    if (!faulted_) fault_.store(code, std::memory_order_relaxed);
    faulted_ = true;
    may_force_ = false;
    ticks_since_look_ = kStatusEvery;  // the next tick looks
    return trephine::DeviceStatus::kFault;
  }

  trephine::DeviceStatus report(Trip why) noexcept {
    trip_.store(why, std::memory_order_relaxed);
    if (why == Trip::kNone) return trephine::DeviceStatus::kOk;
    trips_.store(trips_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return trephine::DeviceStatus::kSafetyTrip;
  }

  /// The driver's error of this thread, also where it does not name it.
  static int driver_error() noexcept {
    const int code = dhdErrorGetLast();
    return code != DHD_NO_ERROR ? code : DHD_ERROR;
  }

  static trephine::Vec3d shortened(const trephine::Vec3d& v, double limit) noexcept {
    const double norm = v.stableNorm();
    return norm > limit ? trephine::Vec3d(v * (limit / norm)) : v;
  }

  DeviceOptions options_;
  char id_;
  trephine::DeviceCapabilities capabilities_;
  bool left_ = false;
  bool gripper_ = false;
  // The servo thread's.
  trephine::Posed X_DH_ = trephine::Posed::Identity();  // the last new pose
  double fresh_at_ = 0;                                 // when it came [s]
  double slow_since_ = 0;                               // [s]
  Trip halt_ = Trip::kNone;                             // as of the last look
  int ticks_since_look_ = kStatusEvery;                 // the first tick looks
  bool has_pose_ = false;
  bool may_force_ = false;
  bool closed_ = false;
  bool faulted_ = false;
  std::atomic<int> fault_{DHD_NO_ERROR};
  std::atomic<Trip> trip_{Trip::kNone};
  std::atomic<std::uint64_t> trips_{0};
};

static_assert(trephine::HapticDevice<Device> && !trephine::SelfPacedDevice<Device>);

}  // namespace force_dimension
