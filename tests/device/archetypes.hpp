// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>
#include <trephine/device/tickable_scene.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

/// Devices and scenes that do what a test tells them, and remember what was done to them. No allocation in a tick.
namespace trephine::test {

/// One tick of a scripted device.
struct Moment {
  Posed X_DH = Posed::Identity();
  std::uint32_t buttons = 0;
  DeviceStatus read = DeviceStatus::kOk;
  DeviceStatus write = DeviceStatus::kOk;
};

/// A polled device in simulated time. `at` chooses what happens at the n-th read, counted from 0.
template <class Script>
struct ScriptedDevice {
  static constexpr std::size_t kCapacity = 4096;

  Script script;
  DeviceCapabilities can{.name = "scripted"};
  int reads = 0, writes = 0, advances = 0;
  double advanced = 0;
  std::array<Wrenchd, kCapacity> wrote{};

  explicit ScriptedDevice(Script s) : script(s) {}

  [[nodiscard]] DeviceCapabilities capabilities() const { return can; }

  DeviceStatus read(DeviceState& state) noexcept {
    const Moment now = script(reads++);
    state.X_DH = now.X_DH;
    state.buttons = now.buttons;
    return now.read;
  }
  DeviceStatus write(const Wrenchd& wrench) noexcept {
    wrote[static_cast<std::size_t>(writes++) % kCapacity] = wrench;
    return reads > 0 ? script(reads - 1).write : DeviceStatus::kOk;
  }
  void advance(double dt) {
    ++advances;
    advanced += dt;
  }
  [[nodiscard]] const Wrenchd& last() const { return wrote[static_cast<std::size_t>(writes - 1) % kCapacity]; }
};

/// A scene of one wrench and one status, by tick.
struct ScriptedScene {
  static constexpr bool kHasTorque = true;
  Wrenchd wrench{Vec3d(1, -2, 3), Vec3d(0.1, 0.2, -0.3)};
  Status (*status)(int) = [](int) { return Status::kOk; };
  int ticks = 0;
  double time = 0;
  double last_dt = 0;
  TickInput last;

  TickResult tick(const TickInput& input, double dt) noexcept {
    last = input;
    last_dt = dt;
    time += dt;
    TickResult result;
    result.wrench = wrench;
    result.status = status(ticks++);
    return result;
  }
};

/// Bone fills z < 0 of W: a spring at the tip and a torque toward upright, with damping by backward difference, so that
/// it has a memory.
struct FloorScene {
  static constexpr bool kHasTorque = true;
  double k = 500, damping = 1.0;
  double last_z = 0;

  [[nodiscard]] double stiffness() const { return k; }

  TickResult tick(const TickInput& input, double dt) noexcept {
    TickResult result;
    const double z = input.X_WT.translation().z();
    if (z < 0) {
      result.wrench.force.z() = -k * z - damping * (z - last_z) / dt;
      result.wrench.torque = 0.05 * Vec3d(input.X_WT.linear().col(2)).cross(Vec3d::UnitZ());
      result.contact = {.count = 1, .tip = true, .shaft = false, .depth = -z};
    }
    result.removed_mm3 = input.spindle_on && z < 0 ? -z : 0.0;
    last_z = z;
    return result;
  }
};

/// The same, declared to be without torque.
struct ForceOnlyFloorScene : FloorScene {
  static constexpr bool kHasTorque = false;
};

}  // namespace trephine::test
