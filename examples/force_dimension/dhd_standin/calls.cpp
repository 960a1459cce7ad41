// SPDX-License-Identifier: MIT
// The interface's calls. Each takes the lock, so that they may come from any thread.
#include "world.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

namespace dhd_standin {
namespace {

thread_local int last_error = DHD_NO_ERROR;

/// Calls `f(device)` for the open device of an ID; `otherwise` where there is none or it cannot be reached.
template <class Result, class F>
Result with(char id, Result otherwise, F&& f) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Plugged* device = w.find(id);
  return device != nullptr ? f(*device) : otherwise;
}

/// What a device is does not change, so it is known without communication.
template <class F>
bool is(char id, F&& f) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return static_cast<std::size_t>(id) < w.devices.size() && f(*std::next(w.devices.begin(), id));
}

}  // namespace

int fail(int error) {
  last_error = error;
  return -1;
}

}  // namespace dhd_standin

using namespace dhd_standin;

extern "C" {

int dhdErrorGetLast() { return last_error; }

const char* dhdErrorGetStr(int error) {
  return error == DHD_ERROR_COM               ? "communication lost"
         : error == DHD_ERROR_NO_DEVICE_FOUND ? "no such device"
         : error == DHD_ERROR_NOT_AVAILABLE   ? "not available"
                                              : "some error";
}

int dhdGetDeviceCount() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return w.fault == Fault::kUnplugged ? 0 : static_cast<int>(w.devices.size());
}

int drdOpenID(char ID) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (ID < 0 || ID >= dhdGetDeviceCount()) return fail(DHD_ERROR_NO_DEVICE_FOUND);
  Plugged& d = *std::next(w.devices.begin(), ID);
  if (d.open) return fail(DHD_ERROR_NOT_AVAILABLE);
  d.open = true;
  d.witness = Witness{};
  return ID;
}

int drdClose(char ID) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const bool reached = w.find(ID) != nullptr;
  if (static_cast<std::size_t>(ID) < w.devices.size()) std::next(w.devices.begin(), ID)->open = false;
  return reached ? 0 : -1;
}

const char* dhdGetSystemName(char ID) {
  return with<const char*>(ID, nullptr, [](Plugged& d) { return d.model.name.c_str(); });
}
bool dhdIsLeftHanded(char ID) {
  return is(ID, [](const Plugged& d) { return d.model.left; });
}
bool dhdHasWrist(char ID) {
  return is(ID, [](const Plugged& d) { return d.model.wrist; });
}
bool dhdHasActiveWrist(char ID) {
  return is(ID, [](const Plugged& d) { return d.model.active_wrist; });
}
bool dhdHasGripper(char ID) {
  return is(ID, [](const Plugged& d) { return d.model.gripper; });
}
bool drdIsSupported(char ID) {
  return is(ID, [](const Plugged& d) { return d.model.robotic; });
}
bool drdIsInitialized(char ID) {
  return with(ID, false, [](Plugged& d) { return d.calibrated; });
}
int drdAutoInit(char ID) {
  return with(ID, -1, [](Plugged& d) {
    if (!d.model.robotic) return fail(DHD_ERROR_NOT_AVAILABLE);
    d.calibrated = true;
    return 0;
  });
}
int drdStop(bool frc, char ID) {
  return with(ID, -1, [frc](Plugged& d) {
    d.witness.enabled = frc;
    return 0;
  });
}

int dhdGetStatus(int status[DHD_MAX_STATUS], char ID) {
  return with(ID, -1, [status](Plugged& d) {
    std::fill(status, status + DHD_MAX_STATUS, 0);
    status[DHD_STATUS_POWER] = status[DHD_STATUS_CONNECTED] = 1;
    status[DHD_STATUS_RESET] = !d.calibrated;
    status[DHD_STATUS_FORCE] = d.witness.enabled;
    status[DHD_STATUS_BRAKE] = !d.witness.enabled;
    status[DHD_STATUS_ERROR] = World::get().fault == Fault::kError;
    status[DHD_STATUS_WRIST_INIT] = d.model.wrist && d.calibrated;
    status[DHD_STATUS_FORCEOFFCAUSE] = d.witness.cause;
    return 0;
  });
}

int dhdGetPositionAndOrientationFrame(double* px, double* py, double* pz, double matrix[3][3], char ID) {
  return with(ID, -1, [=](Plugged& d) {
    const double t = now();
    const Fault fault = World::get().fault;
    const bool guarded = d.read_at >= 0 && (t - d.read_at < d.model.time_guard || fault == Fault::kStale);
    if (!guarded) {
      d.read = d.sensed(fault);
      d.read_at = t;
    }
    *px = d.read.translation().x();
    *py = d.read.translation().y();
    *pz = d.read.translation().z();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) matrix[i][j] = d.read.linear()(i, j);
    return guarded ? DHD_TIMEGUARD : 0;
  });
}

int dhdGetLinearVelocity(double* vx, double* vy, double* vz, char ID) {
  return with(ID, -1, [=](Plugged& d) {
    const trephine::Vec3d v = d.mechanics.velocity().linear;
    *vx = v.x();
    *vy = v.y();
    *vz = v.z();
    return 0;
  });
}

int dhdGetGripperAngleRad(double* a, char ID) {
  return with(ID, -1, [a](Plugged& d) {
    if (!d.model.gripper) return fail(DHD_ERROR_NOT_AVAILABLE);
    *a = d.model.left ? -d.gripper_angle : d.gripper_angle;
    return 0;
  });
}

unsigned int dhdGetButtonMask(char ID) {
  return with(ID, 0U, [](Plugged& d) {
    trephine::DeviceState state;
    (void)d.mechanics.read(state);
    return state.buttons;
  });
}

int dhdEnableForce(unsigned char val, char ID) {
  return with(ID, -1, [val](Plugged& d) {
    if (val == DHD_OFF) d.brake(DHD_FORCEOFF_SOFTWARE, now());
    if (val == DHD_ON && d.calibrated) d.witness.enabled = true;
    if (val == DHD_ON) d.commanded = now();
    return 0;
  });
}

int dhdSetGravityCompensation(int val, char ID) {
  return with(ID, -1, [val](Plugged& d) {
    d.compensates = val == DHD_ON;
    return 0;
  });
}

int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double fg,
                                        char ID) {
  return with(ID, -1, [=](Plugged& d) {
    const trephine::Wrenchd wrench{trephine::Vec3d(fx, fy, fz), trephine::Vec3d(tx, ty, tz)};
    if (!trephine::is_finite(wrench) || !std::isfinite(fg)) return fail(DHD_ERROR);
    d.command(wrench);
    const bool most = wrench.force.norm() > d.model.max_force || wrench.torque.norm() > d.model.max_torque;
    return most ? DHD_MOTOR_SATURATED : 0;
  });
}

int dhdEnableExpertMode() {
  World::get().expert = true;
  return 0;
}
int dhdDisableExpertMode() {
  World::get().expert = false;
  return 0;
}

int dhdSetWatchdog(unsigned char val, char ID) {
  return with(ID, -1, [val](Plugged& d) {
    if (!World::get().expert) return fail(DHD_ERROR_EXPERT_MODE_DISABLED);
    d.watchdog = 125e-6 * val;
    return 0;
  });
}
}
