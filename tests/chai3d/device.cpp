// SPDX-License-Identifier: MIT
#include "chai3d_device.hpp"

#include "simulated_hand.hpp"

#include <trephine/device/servo_loop.hpp>

#include <doctest/doctest.h>

#include "support/near.hpp"

#include <chrono>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "device/archetypes.hpp"

namespace {

using namespace trephine;
using namespace trephine::test;
using chai3d_host::Device;

/// A device of CHAI3D that does as a test says.
struct Told : chai3d::cGenericHapticDevice {
  bool opens = true, calibrates = true, reads_position = true, reads_rotation = true, reads_switches = true,
       sends = true;
  chai3d::cVector3d position{0.01, 0.02, 0.03};
  chai3d::cMatrix3d rotation{0, -1, 0, 1, 0, 0, 0, 0, 1};  // x to y
  chai3d::cVector3d force{9, 9, 9}, torque{9, 9, 9};
  int closed = 0;

  Told() {
    m_specifications.m_model = chai3d::C_HAPTIC_DEVICE_CUSTOM;
    m_specifications.m_maxLinearForce = 4;
    m_specifications.m_maxAngularTorque = 0.2;
    m_specifications.m_actuatedPosition = m_specifications.m_actuatedRotation = m_specifications.m_sensedRotation =
        true;
  }
  bool open() override { return opens; }
  bool close() override { return ++closed > 0; }
  bool calibrate(bool) override { return calibrates; }
  bool getPosition(chai3d::cVector3d& p) override { return p = position, reads_position; }
  bool getRotation(chai3d::cMatrix3d& R) override { return R = rotation, reads_rotation; }
  bool getUserSwitches(unsigned int& s) override { return s = 5, reads_switches; }
  bool setForceAndTorqueAndGripperForce(const chai3d::cVector3d& f, const chai3d::cVector3d& t, double) override {
    return force = f, torque = t, sends;
  }
};

Vec3d vector_of(const chai3d::cVector3d& v) { return {v(0), v(1), v(2)}; }

}  // namespace

TEST_CASE("CHAI3D: pose, switches and capabilities pass as they are") {
  const auto told = std::make_shared<Told>();
  Device device(told);
  DeviceState state;
  REQUIRE(device.read(state) == DeviceStatus::kOk);
  CHECK(state.X_DH.translation() == Vec3d(0.01, 0.02, 0.03));
  CHECK(state.X_DH.linear() * Vec3d::UnitX() == Vec3d::UnitY());
  CHECK(state.buttons == 5);
  const DeviceCapabilities able = device.capabilities();
  CHECK(able.name == "CHAI3D no device");
  CHECK(able.input_dof == 6);
  CHECK(able.output_dof == 6);
  CHECK(able.max_force == 4);
  CHECK(able.max_torque == 0.2);
}

TEST_CASE("CHAI3D: a device without motors has none") {
  const auto told = std::make_shared<Told>();
  told->m_specifications.m_actuatedRotation = false;
  CHECK(Device(told).capabilities().output_dof == 3);
  told->m_specifications.m_actuatedPosition = told->m_specifications.m_sensedRotation = false;
  CHECK(Device(told).capabilities().output_dof == 0);
  CHECK(Device(told).capabilities().input_dof == 3);
}

TEST_CASE("CHAI3D: the stylus along x is the shaft along z") {
  const Registration registration = chai3d_host::registration();
  const Posed X_WT = registration.tool_pose(Posed::Identity());
  CHECK((z_axis(X_WT) - Vec3d::UnitX()).norm() < 1e-15);
}

TEST_CASE("CHAI3D: force and torque are sent within the device's limits, and nothing that is not finite") {
  const auto told = std::make_shared<Told>();
  Device device(told);
  CHECK(device.write({Vec3d(1, 2, 3), Vec3d(0.01, 0.02, 0.03)}) == DeviceStatus::kOk);
  CHECK(vector_of(told->force) == Vec3d(1, 2, 3));
  CHECK(vector_of(told->torque) == Vec3d(0.01, 0.02, 0.03));
  CHECK(device.write({Vec3d(30, 0, -40), Vec3d(0, 1, 0)}) == DeviceStatus::kOk);
  CHECK((vector_of(told->force) - Vec3d(2.4, 0, -3.2)).norm() < 1e-14);
  CHECK((vector_of(told->torque) - Vec3d(0, 0.2, 0)).norm() < 1e-15);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CHECK(device.write({Vec3d(1, bad, 0), Vec3d(1, 0, 0)}) == DeviceStatus::kFault);
    CHECK(vector_of(told->force) == Vec3d::Zero());
    CHECK(vector_of(told->torque) == Vec3d::Zero());
  }
  CHECK(std::string(device.fault_text()) == "the command is not finite");
}

TEST_CASE("CHAI3D: a call that fails is a fault, and the first is told") {
  const struct {
    bool Told::*works;
    const char* text;
  } cases[] = {{&Told::reads_position, "getPosition failed"},
               {&Told::reads_rotation, "getRotation failed"},
               {&Told::reads_switches, "getUserSwitches failed"}};
  for (const auto& c : cases) {
    const auto told = std::make_shared<Told>();
    Device device(told);
    DeviceState state;
    CHECK(std::string(device.fault_text()).empty());
    told.get()->*c.works = false;
    CHECK(device.read(state) == DeviceStatus::kFault);
    told->sends = false;
    CHECK(device.write(Wrenchd::zero()) == DeviceStatus::kFault);
    CHECK(std::string(device.fault_text()) == c.text);
  }
  const auto told = std::make_shared<Told>();
  Device device(told);
  DeviceState state;
  told->position.set(0, std::numeric_limits<double>::quiet_NaN(), 0);
  CHECK(device.read(state) == DeviceStatus::kFault);
}

TEST_CASE("CHAI3D: a device that does not open or calibrate is refused and left closed") {
  CHECK_THROWS_AS(Device(nullptr), std::runtime_error);
  const auto told = std::make_shared<Told>();
  told->opens = false;
  CHECK_THROWS_AS(Device{told}, std::runtime_error);
  told->opens = true;
  told->calibrates = false;
  CHECK_THROWS_AS(Device{told}, std::runtime_error);
  CHECK(told->closed == 1);
}

TEST_CASE("CHAI3D: no force stays when the device goes") {
  const auto told = std::make_shared<Told>();
  {
    Device device(told);
    (void)device.write({Vec3d(1, 2, 3), Vec3d::Zero()});
  }
  CHECK(vector_of(told->force) == Vec3d::Zero());
  CHECK(told->closed == 1);
}

TEST_CASE("CHAI3D: a lost device ends the loop with zero and the reason") {
  const auto told = std::make_shared<Told>();
  Device device(told);
  FloorScene scene;
  ServoLoop loop(device, scene, chai3d_host::registration());
  const RunReport report = loop.run_until([](const TickRecord&) { return false; },
                                          [&](const TickRecord& tick) { told->reads_position = tick.index < 20; });
  CHECK(report.end == RunEnd::kFault);
  CHECK(report.reason.find("getPosition failed") != std::string::npos);
  CHECK(vector_of(told->force) == Vec3d::Zero());
}

TEST_CASE("CHAI3D: the simulated hand reads nothing while it is closed") {
  chai3d_host::SimulatedHand hand;
  chai3d::cVector3d p;
  CHECK_FALSE(hand.getPosition(p));
  CHECK(hand.open());
  CHECK(hand.getPosition(p));
  CHECK(p(2) == trephine::test::within(5e-3, 1e-4));
}
