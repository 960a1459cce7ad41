// SPDX-License-Identifier: MIT
#pragma once

#include "chai3d_device.hpp"

#include <trephine/core/units.hpp>
#include <trephine/device/simulated_device.hpp>

#include <algorithm>
#include <cmath>

namespace chai3d_host {

/// A device of CHAI3D without hardware, in a simulated hand that holds the drill upright over the bone at the origin.
/// The hand comes down, presses the button after a second and mills a slot. The device yields to the force that it is
/// sent. Each reading of its position is a millisecond after the last, at any rate of the loop.
class SimulatedHand : public chai3d::cGenericHapticDevice {
 public:
  SimulatedHand() : device_(start(), &target) {
    const trephine::DeviceCapabilities able = device_.capabilities();
    m_deviceAvailable = true;
    m_specifications.m_model = chai3d::C_HAPTIC_DEVICE_CUSTOM;  // CHAI3D leaves it unset
    m_specifications.m_manufacturerName = "trephine";
    m_specifications.m_modelName = able.name;
    m_specifications.m_maxLinearForce = able.max_force;
    m_specifications.m_maxAngularTorque = able.max_torque;
    m_specifications.m_maxLinearStiffness = able.stiffness;
    m_specifications.m_maxAngularStiffness = able.angular_stiffness;
    m_specifications.m_sensedPosition = m_specifications.m_sensedRotation = true;
    m_specifications.m_actuatedPosition = m_specifications.m_actuatedRotation = true;
  }

  bool open() override { return m_deviceReady = true; }
  bool close() override {
    m_deviceReady = false;
    return true;
  }
  bool getPosition(chai3d::cVector3d& p) override {
    if (m_deviceReady) device_.advance(1e-3);
    const bool read = m_deviceReady && device_.read(state_) == trephine::DeviceStatus::kOk;
    p = to_chai3d(trephine::Vec3d(state_.X_DH.translation()));
    return read;
  }
  bool getRotation(chai3d::cMatrix3d& R) override {
    R = to_chai3d(trephine::Mat3d(state_.X_DH.linear()));
    return m_deviceReady;
  }
  bool getUserSwitches(unsigned int& switches) override {
    switches = state_.buttons;
    return m_deviceReady;
  }
  bool setForceAndTorqueAndGripperForce(const chai3d::cVector3d& f, const chai3d::cVector3d& t, double) override {
    const trephine::Wrenchd wrench{{f(0), f(1), f(2)}, {t(0), t(1), t(2)}};
    return m_deviceReady && device_.write(wrench) == trephine::DeviceStatus::kOk;
  }

 private:
  static trephine::HandTarget target(double t) {
    using trephine::operator""_mm, trephine::Vec3d;
    trephine::HandTarget target;
    const double depth = std::min(5_mm * t, 8_mm), across = std::clamp(6_mm * (t - 2), 0.0, 6_mm);
    target.X_DH.translation() = Vec3d(0, across * std::sin(3 * (t - 2)), 5_mm - depth);
    target.X_DH.linear() = trephine::rotation_between<double>(Vec3d::UnitX(), Vec3d::UnitZ());  // the stylus stands
    target.buttons = t > 1 ? 1 : 0;
    return target;
  }
  static trephine::SimulatedDeviceOptions start() { return {.X_DH = target(0).X_DH}; }

  trephine::SimulatedDevice<trephine::HandTarget (*)(double)> device_;
  trephine::DeviceState state_;
};

}  // namespace chai3d_host
