// SPDX-License-Identifier: MIT
#pragma once

#include "dhd_standin/dhd_standin.hpp"
#include "force_dimension_device.hpp"

#include <optional>
#include <string>

namespace trephine::test {

/// A stand-in device that is easy to reckon with: so heavy that the hand and the force move it by nothing worth a name.
inline dhd_standin::Model rigid(const std::string& name, const Posed& X_DH = Posed::Identity()) {
  dhd_standin::Model model = dhd_standin::model(name);
  model.mechanics.linear = {.inertia = 1000, .damping = 0, .friction = 0, .quantum = 0, .limit = 0};
  model.mechanics.angular = {.inertia = 1000, .damping = 0, .friction = 0, .quantum = 0, .limit = 0};
  model.mechanics.X_DH = X_DH;
  return model;
}

/// An opened device whose time passes by ticks alone, so that nothing depends on the machine's load.
struct Bench {
  static constexpr double kTick = 1e-3;
  /// What every tick writes, also after a trip or a fault: the adapter, not the caller, must keep it from the hand.
  Wrenchd push{Vec3d(1, -2, 2), Vec3d(0.01, 0, 0)};
  std::optional<force_dimension::Device> device;
  DeviceState state;
  DeviceStatus read = DeviceStatus::kOk, wrote = DeviceStatus::kOk;

  explicit Bench(const dhd_standin::Model& model, force_dimension::DeviceOptions options = {}) {
    dhd_standin::hold_clock(true);
    dhd_standin::plug({model});
    options.clock = &dhd_standin::now;
    device.emplace(options);
  }
  ~Bench() {
    device.reset();
    dhd_standin::hold_clock(false);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  DeviceStatus tick() {
    dhd_standin::pass(kTick);
    read = device->read(state);
    wrote = device->write(push);
    return worse(read, wrote);
  }
  DeviceStatus ticks(int n) {
    DeviceStatus last = DeviceStatus::kOk;
    for (int i = 0; i < n; ++i) last = tick();
    return last;
  }
  /// Ticks until the force is out, which takes as long as the handle must be held.
  void start() { ticks(static_cast<int>(force_dimension::Device::kHeld / kTick) + 5); }
};

inline dhd_standin::Witness seen() { return dhd_standin::witness(); }

}  // namespace trephine::test
