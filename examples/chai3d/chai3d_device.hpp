// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/rotation.hpp>
#include <trephine/device/device.hpp>
#include <trephine/device/device_match.hpp>
#include <trephine/device/registration.hpp>

#include <devices/CGenericHapticDevice.h>

#include <stdexcept>
#include <utility>

namespace chai3d_host {

inline chai3d::cVector3d to_chai3d(const trephine::Vec3d& v) { return {v.x(), v.y(), v.z()}; }
inline chai3d::cMatrix3d to_chai3d(const trephine::Mat3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
inline trephine::Posed from_chai3d(const chai3d::cVector3d& p, const chai3d::cMatrix3d& m) {
  trephine::Mat3d R;
  R << m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2);
  return trephine::make_pose<double>(R, {p(0), p(1), p(2)});
}

/// Registration of a device of CHAI3D. Its stylus lies along H's x axis, toward the user, and the drill's shaft along
/// T's z axis, so X_HT turns z into x.
inline trephine::Registration registration(const trephine::Posed& X_WD = trephine::Posed::Identity(),
                                           double scale = 1) {
  using trephine::Vec3d;
  const trephine::Mat3d R_HT = trephine::rotation_between<double>(Vec3d::UnitZ(), Vec3d::UnitX());
  return trephine::Registration{X_WD, trephine::make_pose<double>(R_HT, Vec3d::Zero()), scale};
}

/// Any haptic device of CHAI3D, for trephine's servo loop, which polls it. Not affiliated with CHAI3D.
///
/// D is CHAI3D's frame: x toward the user, y right, z up, in metres; forces in N and torques in N·m about the device's
/// position. A call that CHAI3D answers with false is a fault, and so is a reading that is not finite. A command that
/// is not finite is sent as zero. CHAI3D tells no safety trips and no rate, so the loop ticks at 1 kHz unless told
/// otherwise.
class Device {
 public:
  /// Opens and calibrates the device, which may move its arm. Throws std::runtime_error if CHAI3D cannot.
  explicit Device(chai3d::cGenericHapticDevicePtr device) : device_(std::move(device)) {
    if (!device_ || !device_->open())
      throw std::runtime_error("CHAI3D cannot open the device: is it connected and its driver installed?");
    if (!device_->calibrate()) {
      device_->close();
      throw std::runtime_error("CHAI3D cannot calibrate the device: follow its maker's instructions");
    }
    const chai3d::cHapticDeviceInfo about = device_->getSpecifications();
    able_ = {.name = about.m_manufacturerName + " " + about.m_modelName,
             .input_dof = about.m_sensedRotation ? 6 : 3,
             .output_dof = about.m_actuatedRotation   ? 6
                           : about.m_actuatedPosition ? 3
                                                      : 0,
             .max_force = about.m_maxLinearForce,
             .max_torque = about.m_maxAngularTorque,
             .stiffness = about.m_maxLinearStiffness,
             .angular_stiffness = about.m_maxAngularStiffness};
  }
  ~Device() {
    (void)send(trephine::Wrenchd::zero());
    device_->close();
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] trephine::DeviceCapabilities capabilities() const { return able_; }

  trephine::DeviceStatus read(trephine::DeviceState& state) noexcept {
    chai3d::cVector3d p(0, 0, 0);
    chai3d::cMatrix3d R;
    R.identity();
    unsigned int switches = 0;
    if (!device_->getPosition(p)) return fault("getPosition failed");
    if (!device_->getRotation(R)) return fault("getRotation failed");
    if (!device_->getUserSwitches(switches)) return fault("getUserSwitches failed");
    state = {.X_DH = from_chai3d(p, R), .buttons = switches, .time = std::nullopt};
    return trephine::is_finite(state.X_DH) ? trephine::DeviceStatus::kOk : fault("the pose is not finite");
  }

  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept {
    const bool finite = trephine::is_finite(wrench_H_D);
    trephine::Wrenchd command = finite ? wrench_H_D : trephine::Wrenchd::zero();
    (void)trephine::limit_to(able_, command);
    if (!send(command)) return fault("setForceAndTorqueAndGripperForce failed");
    return finite ? trephine::DeviceStatus::kOk : fault("the command is not finite");
  }

  /// The first fault, for the loop's report.
  [[nodiscard]] const char* fault_text() const noexcept { return fault_; }

 private:
  bool send(const trephine::Wrenchd& w) noexcept {
    return device_->setForceAndTorqueAndGripperForce(to_chai3d(w.force), to_chai3d(w.torque), 0);
  }
  trephine::DeviceStatus fault(const char* text) noexcept {
    if (*fault_ == '\0') fault_ = text;  // later faults are often its consequence
    return trephine::DeviceStatus::kFault;
  }

  chai3d::cGenericHapticDevicePtr device_;
  trephine::DeviceCapabilities able_;
  const char* fault_ = "";
};

static_assert(trephine::HapticDevice<Device> && !trephine::SelfPacedDevice<Device>);

}  // namespace chai3d_host
