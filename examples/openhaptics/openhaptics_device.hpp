// SPDX-License-Identifier: MIT
#pragma once

#include "openhaptics_scheduler.hpp"
#include "openhaptics_units.hpp"

#include <trephine/device/device.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>

namespace openhaptics {

struct DeviceOptions {
  std::string name{};            ///< as set up in the driver; empty: its default device
  double unknown_force = 1;      ///< limit where the device tells none [N]
  double unknown_torque = 0.02;  ///< the same for torque [N·m]
};

/// Whether the device's pose can be believed.
enum class Calibration : int { kUnknown, kGood, kBusy, kNeedsHand };

/// A device behind the OpenHaptics HD interface, for trephine's servo loop. Not affiliated with OpenHaptics.
///
/// The driver's scheduler calls the loop once a servo tick: `read` opens a frame and takes pose and buttons, `write`
/// sets force and torque and closes it, so that what was computed from a pose is felt in the same tick. Frames and
/// units: `openhaptics_units.hpp`; H is the point that the driver's position means, torques are about it. Force goes
/// out on devices with 3 output degrees of freedom, torque on those with 6; both are shortened to the device's nominal
/// maxima.
///
/// - A safety trip (hot motors, too much force or speed) is reported as one; the loop goes on with zero and a ramp.
/// - Anything else on the error stack is a fault; `fault_text` then says what to do.
/// - Until the device is calibrated `read` reports a safety trip, also in the tick in which the pose may jump: no force
///   before the pose is right. Calibration that needs no hand is done here.
///
/// Several devices share scheduler and servo thread (`SharedScheduler`): open all of them before the first one starts.
/// Threads: `read` and `write` in the callback, everything else in the controlling thread; `calibration` and `tripped`
/// in any. Neither `read` nor `write` locks, allocates or throws.
class Device {
 public:
  /// Opens the device. Throws std::runtime_error: what, and what to do.
  explicit Device(const DeviceOptions& options = {})
      : options_(options), slot_(SharedScheduler::instance().open(options.name)), device_(slot_.device.load()) {
    query_capabilities();
  }
  ~Device() {
    stop();
    SharedScheduler::instance().close(slot_);
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] trephine::DeviceCapabilities capabilities() const { return capabilities_; }

  [[nodiscard]] trephine::DeviceStatus read(trephine::DeviceState& state) noexcept {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    hdBeginFrame(device_);
    frame_open_ = true;
    std::array<HDdouble, 16> transform;
    transform.fill(kNone);
    HDint buttons = 0;
    hdGetDoublev(HD_CURRENT_TRANSFORM, transform.data());
    hdGetIntegerv(HD_CURRENT_BUTTONS, &buttons);
    const bool calibrated = follow_calibration();
    const trephine::DeviceStatus status = drain();
    if (status == trephine::DeviceStatus::kFault) return status;
    state.X_DH = pose_from_transform(transform);
    if (capabilities_.input_dof < 6) state.X_DH.linear().setIdentity();
    state.buttons = static_cast<std::uint32_t>(buttons);
    state.time.reset();
    if (!state.X_DH.matrix().allFinite()) return fault(kNonFinitePose);
    return calibrated ? status : trephine::DeviceStatus::kSafetyTrip;
  }

  /// Commits the frame that `read` opened. Without one there is nothing to commit: kFault, and nothing changes.
  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept {
    if (!frame_open_) return trephine::DeviceStatus::kFault;
    const bool finite = trephine::is_finite(wrench_H_D);
    if (finite && capabilities_.output_dof >= 3)
      hdSetDoublev(HD_CURRENT_FORCE, force_to_driver(shortened(wrench_H_D.force, capabilities_.max_force)).data());
    if (finite && capabilities_.output_dof == 6)
      hdSetDoublev(HD_CURRENT_TORQUE, torque_to_driver(shortened(wrench_H_D.torque, capabilities_.max_torque)).data());
    end_frame();  // what was not set is zero since the frame began
    const trephine::DeviceStatus status = drain();
    return finite ? status : fault(kNonFiniteCommand);
  }

  trephine::DeviceStatus start(trephine::ServoCallback callback, void* user) noexcept {
    if (running_) return fault(HD_INVALID_OPERATION);
    callback_ = callback;
    user_ = user;
    fault_.store(HD_SUCCESS, std::memory_order_relaxed);
    quit_.store(false, std::memory_order_relaxed);
    finished_.store(false, std::memory_order_relaxed);
    const HDerror error = SharedScheduler::instance().start(&Device::tick, this, handle_);
    if (error != HD_SUCCESS) return fault(error);
    running_ = true;
    return trephine::DeviceStatus::kOk;
  }

  /// Waits for a last frame of zero force, a tenth of a second at most, before the callback is taken away.
  void stop() noexcept {
    if (!running_) return;
    quit_.store(true, std::memory_order_release);
    const auto patience = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
    while (!finished_.load(std::memory_order_acquire) && std::chrono::steady_clock::now() < patience)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    SharedScheduler::instance().stop(handle_, finished_.load(std::memory_order_acquire));
    running_ = false;
    frame_open_ = false;
  }

  /// The first fault since the start and what to do about it. Not in the servo thread.
  [[nodiscard]] std::string fault_text() const { return describe(fault_.load(std::memory_order_relaxed)); }
  [[nodiscard]] Calibration calibration() const noexcept { return calibration_.load(std::memory_order_relaxed); }
  /// Ticks in which the driver reported a safety trip.
  [[nodiscard]] std::uint64_t trips() const noexcept { return trips_.load(std::memory_order_relaxed); }

 private:
  static constexpr int kCheckEvery = 100;  // ticks between looks at a calibration that is good

  /// Between open and start: the servo thread does not run, the device is the driver's current one.
  void query_capabilities() {
    const auto integer = [](HDenum name, int otherwise) {
      HDint v = otherwise;
      hdGetIntegerv(name, &v);
      return v;
    };
    const auto positive = [](HDenum name) {
      HDdouble v = 0;
      hdGetDoublev(name, &v);
      return v > 0 && std::isfinite(v) ? v : 0.0;
    };
    trephine::DeviceCapabilities& c = capabilities_;
    const HDstring model = hdGetString(HD_DEVICE_MODEL_TYPE);
    const HDstring serial = hdGetString(HD_DEVICE_SERIAL_NUMBER);
    c.name = model != nullptr ? model : "OpenHaptics device";
    if (serial != nullptr && *serial != '\0') c.name += std::string(" ") + serial;
    c.input_dof = integer(HD_INPUT_DOF, 6);
    c.output_dof = integer(HD_OUTPUT_DOF, 3);
    const HDint rate = integer(HD_UPDATE_RATE, 0);
    c.rate = rate >= 100 && rate <= 100000 ? rate : 0;  // an average over no ticks yet says nothing
    c.stiffness = stiffness_from_driver(positive(HD_NOMINAL_MAX_STIFFNESS));
    c.max_force = positive(HD_NOMINAL_MAX_FORCE);
    if (!(c.max_force > 0)) c.max_force = options_.unknown_force;
    if (c.output_dof == 6) {
      c.max_torque = torque_from_driver(positive(HD_NOMINAL_MAX_TORQUE_FORCE));
      if (!(c.max_torque > 0)) c.max_torque = options_.unknown_torque;
    }
    HDerror ignored = HD_SUCCESS;  // what a device does not know is an error there and a default here
    (void)SharedScheduler::instance().drain(slot_, ignored);
  }

  /// The driver's call. A frame that the loop left open is closed, with whatever force was set in it.
  static HDCallbackCode HDCALLBACK tick(void* user) noexcept {
    auto& self = *static_cast<Device*>(user);
    bool more = false;
    if (self.quit_.load(std::memory_order_acquire)) {
      hdBeginFrame(self.device_);  // zeroes force and torque
      self.frame_open_ = true;
    } else {
      more = self.callback_(self.user_);
    }
    if (self.frame_open_) {
      self.end_frame();
      (void)self.drain();
    }
    if (more) return HD_CALLBACK_CONTINUE;
    self.finished_.store(true, std::memory_order_release);  // nothing of this object is touched after
    return HD_CALLBACK_DONE;
  }

  void end_frame() noexcept {
    hdEndFrame(device_);
    frame_open_ = false;
  }

  trephine::DeviceStatus drain() noexcept {
    HDerror code = HD_SUCCESS;
    const trephine::DeviceStatus status = SharedScheduler::instance().drain(slot_, code);
    if (status == trephine::DeviceStatus::kFault) return fault(code);
    if (status == trephine::DeviceStatus::kSafetyTrip)
      trips_.store(trips_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return status;
  }

  /// The first one is kept: what follows is often only its consequence.
  trephine::DeviceStatus fault(HDerror code) noexcept {
    HDerror none = HD_SUCCESS;
    fault_.compare_exchange_strong(none, code, std::memory_order_relaxed);
    return trephine::DeviceStatus::kFault;
  }

  /// True while the pose is good, and was in the tick before.
  bool follow_calibration() noexcept {
    const Calibration before = calibration_.load(std::memory_order_relaxed);
    if (before == Calibration::kGood && ++ticks_since_check_ < kCheckEvery) return true;
    ticks_since_check_ = 0;
    const HDenum found = hdCheckCalibration();
    Calibration now = Calibration::kNeedsHand;
    if (found == HD_CALIBRATION_OK) now = Calibration::kGood;
    if (found == HD_CALIBRATION_NEEDS_UPDATE) {
      now = Calibration::kBusy;
      hdUpdateCalibration(hdCheckCalibrationStyle());
    }
    calibration_.store(now, std::memory_order_relaxed);
    const bool good_from_the_start = before == Calibration::kUnknown;
    return now == Calibration::kGood && (before == Calibration::kGood || good_from_the_start);
  }

  static trephine::Vec3d shortened(const trephine::Vec3d& v, double limit) noexcept {
    const double norm = v.stableNorm();
    return norm > limit ? trephine::Vec3d(v * (limit / norm)) : v;
  }

  DeviceOptions options_;
  SharedScheduler::Slot& slot_;
  HHD device_;
  trephine::DeviceCapabilities capabilities_;
  trephine::ServoCallback callback_ = nullptr;
  void* user_ = nullptr;
  HDSchedulerHandle handle_ = 0;
  bool running_ = false;
  bool frame_open_ = false;    // servo thread
  int ticks_since_check_ = 0;  // servo thread
  std::atomic<bool> quit_{false};
  std::atomic<bool> finished_{false};
  std::atomic<HDerror> fault_{HD_SUCCESS};
  std::atomic<Calibration> calibration_{Calibration::kUnknown};
  std::atomic<std::uint64_t> trips_{0};
};

static_assert(trephine::SelfPacedDevice<Device>);

}  // namespace openhaptics
