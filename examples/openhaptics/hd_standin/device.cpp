// SPDX-License-Identifier: MIT
// The functions of HD/hd.h for devices, frames and values.
#include "world.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

using hd_standin::At;
using hd_standin::Model;
using hd_standin::Opened;
using hd_standin::World;

namespace {

enum class Kind { kUnknown, kInteger, kReal };

/// The values of a name; what a model does not know answers zero.
struct Values {
  Kind kind = Kind::kUnknown;
  std::size_t count = 0;
  std::array<double, 16> v{};
};

Values real(std::initializer_list<double> values) {
  Values out{Kind::kReal, values.size(), {}};
  std::copy(values.begin(), values.end(), out.v.begin());
  return out;
}
Values real(const std::array<double, 3>& a) { return real({a[0], a[1], a[2]}); }
Values integer(int v) { return {Kind::kInteger, 1, {static_cast<double>(v)}}; }

Values values_of(HDenum name, const Opened& d, HDulong rate) {
  const Model& m = d.model;
  switch (name) {
    case HD_CURRENT_BUTTONS:
      return integer(d.buttons);
    case HD_INPUT_DOF:
      return integer(m.input_dof);
    case HD_OUTPUT_DOF:
      return integer(m.output_dof);
    case HD_CALIBRATION_STYLE:
      return integer(1);
    case HD_UPDATE_RATE:
    case HD_INSTANTANEOUS_UPDATE_RATE:
      return integer(static_cast<int>(rate));
    case HD_CURRENT_POSITION:
      return real({d.transform[12], d.transform[13], d.transform[14]});
    case HD_CURRENT_VELOCITY:
      return real(d.velocity);
    case HD_CURRENT_TRANSFORM:
      return {Kind::kReal, 16, d.transform};
    case HD_CURRENT_FORCE:
      return real(d.force);
    case HD_CURRENT_TORQUE:
      return real(d.torque);
    case HD_NOMINAL_MAX_STIFFNESS:
      return real({m.max_stiffness_N_mm});
    case HD_NOMINAL_MAX_FORCE:
      return real({m.max_force_N});
    case HD_NOMINAL_MAX_CONTINUOUS_FORCE:
      return real({m.max_force_N / 4});
    case HD_NOMINAL_MAX_TORQUE_FORCE:
      return m.output_dof == 6 ? real({m.max_torque_mNm}) : Values{};
    case HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE:
      return m.output_dof == 6 ? real({m.max_torque_mNm / 4}) : Values{};
    case HD_MAX_WORKSPACE_DIMENSIONS:
    case HD_USABLE_WORKSPACE_DIMENSIONS:
      return real({-100, -100, -50, 100, 100, 50});
    default:
      return {};
  }
}

template <class T>
void get(HDenum name, T* out, Kind kind) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const Opened* d = w.find(w.current);
  if (d == nullptr) return w.push(HD_BAD_HANDLE);
  const Values values = values_of(name, *d, w.rate);
  if (values.kind == Kind::kUnknown) return w.push(HD_INVALID_ENUM);
  if (values.kind != kind) return w.push(HD_INVALID_INPUT_TYPE);
  for (std::size_t i = 0; i < values.count; ++i) out[i] = static_cast<T>(values.v[i]);
}

template <class T>
void set(HDenum name, const T* in, Kind kind) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Opened* d = w.find(w.current);
  if (d == nullptr) return w.push(HD_BAD_HANDLE);
  if (name != HD_CURRENT_FORCE && name != HD_CURRENT_TORQUE) return w.push(HD_INVALID_ENUM);
  if (kind != Kind::kReal) return w.push(HD_INVALID_INPUT_TYPE);
  if (!d->in_frame || !w.in_servo_thread()) return w.push(HD_FRAME_ERROR);
  if (name == HD_CURRENT_TORQUE && d->model.output_dof != 6) return w.push(HD_INVALID_OPERATION);
  const std::array<double, 3> v{static_cast<double>(in[0]), static_cast<double>(in[1]), static_cast<double>(in[2])};
  if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2])) return w.push(HD_INVALID_VALUE);
  (name == HD_CURRENT_FORCE ? d->force : d->torque) = v;
}

}  // namespace

HHD hdInitDevice(HDstring name) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const auto model =
      std::find_if(w.models.begin(), w.models.end(), [&](const Model& m) { return name == nullptr || m.name == name; });
  if (model == w.models.end()) {
    w.push(HD_COMM_CONFIG_ERROR, HD_INVALID_HANDLE);
    return HD_INVALID_HANDLE;
  }
  const HDerror error = w.find(model->name) != nullptr ? HDerror{HD_DEVICE_ALREADY_INITIATED} : model->open_error;
  if (error != HD_SUCCESS) {
    w.push(error, HD_INVALID_HANDLE);
    return HD_INVALID_HANDLE;
  }
  Opened& d = w.opened.emplace_back(*model, w.next_handle++);
  take_pose(d);
  d.witness.X_DH = d.mechanics.X_DH();
  w.current = d.handle;
  return d.handle;
}

void hdDisableDevice(HHD device) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (w.find(device) == nullptr) return w.push(HD_BAD_HANDLE, device);
  w.opened.remove_if([&](const Opened& d) { return d.handle == device; });
  if (w.current == device) w.current = HD_INVALID_HANDLE;
}

void hdMakeCurrentDevice(HHD device) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (w.find(device) == nullptr) return w.push(HD_BAD_HANDLE, device);
  w.current = device;
}

HHD hdGetCurrentDevice(void) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return w.current;
}

void hdBeginFrame(HHD device) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Opened* d = w.find(device);
  if (d == nullptr) return w.push(HD_BAD_HANDLE, device);
  if (!w.in_servo_thread() || d->in_frame || d->frame_tick == w.tick) return w.push(HD_ILLEGAL_BEGIN, device);
  w.current = device;
  d->in_frame = true;
  d->frame_tick = w.tick;
  d->force = d->torque = {};
  w.injected(At::kBeginFrame, d);
  take_pose(*d);
}

void hdEndFrame(HHD device) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Opened* d = w.find(device);
  if (d == nullptr) return w.push(HD_BAD_HANDLE, device);
  if (!d->in_frame) return w.push(HD_ILLEGAL_END, device);
  d->in_frame = false;
  ++d->witness.frames;
  // An injected error is a trip as any other: nothing reaches the motors.
  if (w.injected(At::kEndFrame, d)) d->unpowered = d->model.trip_time;
  send(*d);
}

void hdEnable(HDenum capability) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Opened* d = w.find(w.current);
  if (d == nullptr) return w.push(HD_BAD_HANDLE);
  if (capability < HD_FORCE_OUTPUT || capability > HD_ONE_FRAME_LIMIT) return w.push(HD_INVALID_ENUM);
  if (capability == HD_FORCE_OUTPUT) d->enabled = true;
}

void hdDisable(HDenum capability) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Opened* d = w.find(w.current);
  if (d == nullptr) return w.push(HD_BAD_HANDLE);
  if (capability < HD_FORCE_OUTPUT || capability > HD_ONE_FRAME_LIMIT) return w.push(HD_INVALID_ENUM);
  if (capability == HD_FORCE_OUTPUT) d->enabled = false;
}

HDboolean hdIsEnabled(HDenum capability) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const Opened* d = w.find(w.current);
  return d != nullptr && capability == HD_FORCE_OUTPUT && d->enabled ? HD_TRUE : HD_FALSE;
}

void hdGetBooleanv(HDenum name, HDboolean* values) { get(name, values, Kind::kInteger); }
void hdGetIntegerv(HDenum name, HDint* values) { get(name, values, Kind::kInteger); }
void hdGetLongv(HDenum name, HDlong* values) { get(name, values, Kind::kInteger); }
void hdGetFloatv(HDenum name, HDfloat* values) { get(name, values, Kind::kReal); }
void hdGetDoublev(HDenum name, HDdouble* values) { get(name, values, Kind::kReal); }
void hdSetBooleanv(HDenum name, const HDboolean* values) { set(name, values, Kind::kInteger); }
void hdSetIntegerv(HDenum name, const HDint* values) { set(name, values, Kind::kInteger); }
void hdSetLongv(HDenum name, const HDlong* values) { set(name, values, Kind::kInteger); }
void hdSetFloatv(HDenum name, const HDfloat* values) { set(name, values, Kind::kReal); }
void hdSetDoublev(HDenum name, const HDdouble* values) { set(name, values, Kind::kReal); }

HDstring hdGetString(HDenum name) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const Opened* d = w.find(w.current);
  if (name == HD_VERSION) return "stand-in";
  if (d == nullptr) return w.push(HD_BAD_HANDLE), nullptr;
  if (name == HD_DEVICE_MODEL_TYPE) return d->model.type.c_str();
  if (name == HD_DEVICE_SERIAL_NUMBER) return "";
  return w.push(HD_INVALID_ENUM), nullptr;
}

HDenum hdCheckCalibration(void) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const Opened* d = w.find(w.current);
  if (d == nullptr) return w.push(HD_BAD_HANDLE), HDenum{HD_CALIBRATION_NEEDS_MANUAL_INPUT};
  return d->model.calibration;
}

HDenum hdCheckCalibrationStyle(void) { return 1; }

void hdUpdateCalibration(HDenum style) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Opened* d = w.find(w.current);
  if (d == nullptr) return w.push(HD_BAD_HANDLE);
  if (style != 1) return w.push(HD_INVALID_VALUE);
  if (d->model.calibration != HD_CALIBRATION_NEEDS_UPDATE) return;
  if (d->calibrating == 0) d->calibrating = d->model.calibration_ticks;
  if (d->calibrating == 0) d->model.calibration = HD_CALIBRATION_OK;
}
