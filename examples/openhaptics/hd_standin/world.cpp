// SPDX-License-Identifier: MIT
#include "world.hpp"

#include <trephine/device/pacing.hpp>
#include <trephine/device/realtime.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hd_standin {

World& World::get() {
  static World world;
  return world;
}

void World::push(HDerror code, HHD device) {
  ++counts[code];
  if (errors.size() == kMaxErrors) errors.erase(errors.begin());
  errors.push_back({code, 0, device});
}

bool World::injected(At at, const Opened* device) {
  bool any = false;
  for (Injection& i : injections) {
    if (i.at != at || i.times == 0) continue;
    if (!i.device.empty() && (device == nullptr || device->model.name != i.device)) continue;
    if (i.after > 0) {
      --i.after;
      continue;
    }
    --i.times;
    push(i.code, device != nullptr ? device->handle : current);
    any = true;
  }
  return any;
}

Opened* World::find(HHD handle) {
  const auto it = std::find_if(opened.begin(), opened.end(), [&](const Opened& d) { return d.handle == handle; });
  return it != opened.end() ? &*it : nullptr;
}

Opened* World::find(const std::string& name) {
  const auto it = std::find_if(opened.begin(), opened.end(), [&](const Opened& d) { return d.model.name == name; });
  return it != opened.end() ? &*it : nullptr;
}

void World::serve() {
  using Clock = trephine::ServoClock;
  const trephine::RealtimeScope priority({});  // as drivers' threads have it, where the system grants it
  const auto period = std::chrono::nanoseconds(1'000'000'000 / static_cast<std::int64_t>(rate));
  auto due = Clock::now();
  auto before = due - period;
  while (running) {
    trephine::sleep_until(due);
    const auto now = Clock::now();
    {
      const std::lock_guard lock(mutex);
      tick_began = std::chrono::duration<double>(now.time_since_epoch()).count();
      serve_tick(std::min(std::chrono::duration<double>(now - before).count(), 0.1));
    }
    ticked.notify_all();
    before = now;
    // As drivers do: ticks that were missed are not made up for.
    due += period;
    if (due < now) due = now;
  }
}

void World::serve_tick(double dt) {
  for (Opened& d : opened) {
    d.mechanics.advance(dt);
    d.unpowered = std::max(0.0, d.unpowered - dt);
    if (d.calibrating > 0 && --d.calibrating == 0) d.model.calibration = HD_CALIBRATION_OK;
    d.witness.X_DH = d.mechanics.X_DH();
    d.witness.powered = !(d.unpowered > 0);
  }
  if (hung) return;
  ++tick;
  for (const Opened& d : opened) injected(At::kTick, &d);
  for (Entry& e : entries)
    if (!e.done) e.done = e.callback(e.user) == HD_CALLBACK_DONE;
  std::erase_if(entries, [](const Entry& e) { return e.done; });
  for (Opened& d : opened) {
    if (!d.in_frame) continue;
    d.in_frame = false;  // what was set in it is lost
    push(HD_FRAME_ERROR, d.handle);
  }
}

void take_pose(Opened& d) {
  trephine::DeviceState state;
  (void)d.mechanics.read(state);
  const trephine::Mat3d R = state.X_DH.linear();
  const trephine::Vec3d p = state.X_DH.translation();
  const double off_mm = d.model.calibration == HD_CALIBRATION_OK ? 0.0 : d.model.calibration_jump_mm;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) d.transform[static_cast<std::size_t>(4 * column + row)] = R(row, column);
  d.transform[3] = d.transform[7] = d.transform[11] = 0;
  d.transform[12] = 1000 * p.x() + off_mm + d.offset_mm;
  d.transform[13] = 1000 * p.y();
  d.transform[14] = 1000 * p.z();
  d.transform[15] = 1;
  if (d.broken_pose) d.transform[12] = std::numeric_limits<double>::quiet_NaN();
  const trephine::Vec3d v = d.mechanics.velocity().linear;
  d.velocity = {1000 * v.x(), 1000 * v.y(), 1000 * v.z()};
  d.buttons = static_cast<int>(state.buttons);
}

void send(Opened& d) {
  World& world = World::get();
  trephine::Wrenchd wrench;
  wrench.force = {d.force[0], d.force[1], d.force[2]};
  if (d.model.output_dof == 6) wrench.torque = trephine::Vec3d(d.torque[0], d.torque[1], d.torque[2]) / 1000;
  constexpr double kRounding = 1 + 1e-9;
  const double most_N = d.model.max_force_N, most_mNm = d.model.max_torque_mNm;
  if ((most_N > 0 && wrench.force.norm() > most_N * kRounding) ||
      (most_mNm > 0 && 1000 * wrench.torque.norm() > most_mNm * kRounding)) {
    world.push(HD_EXCEEDED_MAX_FORCE, d.handle);
    d.unpowered = d.model.trip_time;
  }
  d.witness.most_force = std::max(d.witness.most_force, wrench.force.norm());
  d.witness.most_torque = std::max(d.witness.most_torque, wrench.torque.norm());
  const bool out = d.enabled && !(d.unpowered > 0);
  (void)d.mechanics.write(out ? wrench : trephine::Wrenchd::zero());
  d.witness.felt = d.mechanics.applied();
  d.witness.force_enabled = d.enabled;
}

void plug(std::vector<Model> models) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (w.running || !w.opened.empty())
    throw std::logic_error("hd_standin::plug: close all devices and stop the scheduler first");
  w.models = std::move(models);
  w.errors.clear();
  w.counts.clear();
  w.injections.clear();
  w.entries.clear();
  w.current = HD_INVALID_HANDLE;
  w.rate = 1000;
  w.tick = 0;
  w.hung = false;
}

void inject(const Injection& injection) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  w.injections.push_back(injection);
}

void hang(bool hung) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  w.hung = hung;
}

void calibrate_by_hand(const std::string& device) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (Opened* d = w.find(device)) d->model.calibration = HD_CALIBRATION_OK;
}

void break_pose(const std::string& device, bool broken) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (Opened* d = w.find(device)) d->broken_pose = broken;
}

void offset_pose(const std::string& device, double mm) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (Opened* d = w.find(device)) d->offset_mm = mm;
}

Witness witness(const std::string& device) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const Opened* d = w.find(device);
  return d != nullptr ? d->witness : Witness{};
}

std::map<HDerror, int> errors() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return w.counts;
}

std::uint64_t ticks() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return w.tick;
}

bool scheduler_runs() { return World::get().running; }

int open_devices() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return static_cast<int>(w.opened.size());
}

int scheduled() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return static_cast<int>(w.entries.size());
}

}  // namespace hd_standin
