// SPDX-License-Identifier: MIT
#include "world.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace dhd_standin {
namespace {

std::atomic<bool> clock_held{false};
std::atomic<double> held_at{0};

double steady() noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

AnyHand hand_of(const Model& m) {
  if (m.hand) return {m.hand};
  return {[X_DH = m.mechanics.X_DH](double) { return trephine::HandTarget(X_DH); }};
}

}  // namespace

std::vector<std::string> model_names() { return {"omega.3", "omega.6", "sigma.7", "lambda.7", "lambda.7 left"}; }

Model model(const std::string& name) {
  const std::vector<std::string> names = model_names();
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw std::invalid_argument("dhd_standin::model: there is no " + name);
  Model m;
  m.left = name.size() > 5 && name.substr(name.size() - 5) == " left";
  m.name = m.left ? name.substr(0, name.size() - 5) : name;
  m.wrist = name != "omega.3";
  m.active_wrist = m.gripper = name.find(".7") != std::string::npos;
  m.mechanics.linear.limit = m.max_force;
  return m;
}

Plugged::Plugged(const Model& m)
    : model(m), mechanics(m.mechanics, hand_of(m)), calibrated(m.calibrated), lived(now()) {}

void Plugged::live(double now) {
  constexpr double kStep = 1e-3;
  constexpr double kMost = 0.1;  // longer pauses are not simulated through
  lived = std::max(lived, now - kMost);
  while (lived < now) {
    const double step = std::min(kStep, now - lived);
    mechanics.advance(step);
    lived += step;
    if (!witness.enabled) continue;
    if (mechanics.velocity().linear.norm() > model.speed_limit) brake(DHD_FORCEOFF_VELOCITY, lived);
    if (watchdog > 0 && lived - commanded > watchdog) brake(DHD_FORCEOFF_WATCHDOG, commanded + watchdog);
  }
  lived = std::max(lived, now);
  if (witness.felt.force.norm() > 0 || witness.felt.torque.norm() > 0) witness.felt_until = now;
  witness.X_DH = mechanics.X_DH();
}

void Plugged::brake(int cause, double at) {
  if (witness.felt.force.norm() > 0 || witness.felt.torque.norm() > 0) witness.felt_until = at;
  witness.enabled = false;
  witness.cause = cause;
  witness.felt = trephine::Wrenchd::zero();
  witness.compensation = 0;
  (void)mechanics.write(witness.felt);
}

void Plugged::command(const trephine::Wrenchd& wrench) {
  ++witness.commands;
  witness.command = wrench;
  commanded = now();
  if (!witness.enabled) return;
  witness.felt.force = trephine::simulated::saturated(wrench.force, model.max_force);
  if (model.active_wrist) witness.felt.torque = trephine::simulated::saturated(wrench.torque, model.max_torque);
  witness.compensation = compensates ? kMassOfArm * kStandardGravity : 0;
  witness.most_force = std::max(witness.most_force, witness.felt.force.norm());
  witness.most_torque = std::max(witness.most_torque, witness.felt.torque.norm());
  (void)mechanics.write(witness.felt);  // the arm's weight and its compensation are not simulated
}

trephine::Posed Plugged::sensed(Fault fault) const {
  trephine::Posed X = mechanics.X_DH();
  if (!model.wrist) X.linear().setIdentity();
  if (!calibrated) X.translation().x() += kOffset;
  if (fault == Fault::kJump) X.translation().y() += 0.05;
  if (fault == Fault::kNoRotation) X.linear().setZero();
  if (fault == Fault::kMirrored) X.linear().col(1) *= -1;
  if (fault == Fault::kNoNumber) X.translation().setConstant(std::numeric_limits<double>::quiet_NaN());
  return X;
}

World& World::get() {
  static World world;
  return world;
}

Plugged* World::find(char id) {
  const auto index = static_cast<std::size_t>(static_cast<unsigned char>(id));
  if (index >= devices.size() || !std::next(devices.begin(), id)->open) {
    (void)fail(DHD_ERROR_NO_DEVICE_FOUND);
    return nullptr;
  }
  Plugged& device = *std::next(devices.begin(), id);
  device.live(now());
  if (fault != Fault::kUnplugged && fault != Fault::kCommunication) return &device;
  (void)fail(DHD_ERROR_COM);
  return nullptr;
}

void plug(std::vector<Model> models) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (open_devices() > 0) throw std::logic_error("dhd_standin::plug: a device is open");
  w.devices.clear();
  for (const Model& m : models) w.devices.emplace_back(m);
  w.fault = Fault::kNone;
}

void inject(Fault fault) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  for (Plugged& d : w.devices) {
    d.live(now());
    if (fault == Fault::kUnplugged) d.brake(DHD_FORCEOFF_USBDISCN, now());
    if (fault == Fault::kUncalibrated) d.calibrated = false;
  }
  w.fault = fault;
}

void calibrate_by_hand() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  for (Plugged& d : w.devices) d.calibrated = true;
}

void open_gripper(double angle) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  for (Plugged& d : w.devices) d.gripper_angle = angle;
}

void press_force_button() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  for (Plugged& d : w.devices) {
    d.live(now());
    d.commanded = now();
    if (d.witness.enabled)
      d.brake(DHD_FORCEOFF_BUTTON, now());
    else
      d.witness.enabled = d.calibrated;
  }
}

void hold_clock(bool held) {
  held_at.store(steady());
  clock_held.store(held);
}
void pass(double seconds) { held_at.store(held_at.load() + seconds); }
double now() noexcept { return clock_held.load() ? held_at.load() : steady(); }

Witness witness(std::size_t index) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  Plugged& d = *std::next(w.devices.begin(), static_cast<std::ptrdiff_t>(index));
  d.live(now());
  return d.witness;
}

int open_devices() {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return static_cast<int>(std::count_if(w.devices.begin(), w.devices.end(), [](const Plugged& d) { return d.open; }));
}

}  // namespace dhd_standin
