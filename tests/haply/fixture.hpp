// SPDX-License-Identifier: MIT
#pragma once

#include "haply_device.hpp"
#include "service.hpp"

#include <trephine/device/servo_loop.hpp>

#include <chrono>
#include <thread>

#include "device/archetypes.hpp"

/// What the tests of the adapter against the loopback service share.
namespace haply::test {

/// Whether times mean anything in this build.
#if defined(HAPLY_TESTS_UNTIMED)
inline constexpr bool kTimed = false;
#else
inline constexpr bool kTimed = true;
#endif

/// Waits for what the service or the device is to show, at most ten seconds: a loaded machine is slow, not wrong.
template <class Condition>
bool wait_for(Condition&& condition) {
  for (int ms = 0; ms < 10000; ++ms) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

inline ServiceOptions served(Fault fault = Fault::kNone) {
  ServiceOptions options;
  options.port = 0;
  options.fault = fault;
  return options;
}

inline DeviceOptions at(const Service& service) {
  DeviceOptions options;
  options.port = service.port();
  return options;
}

/// A servo loop in a thread, whose scene gives a force of 2 N at every tick.
class Pushing {
 public:
  static constexpr double kForce = 2;

  explicit Pushing(Device& device)
      : loop_(device, scene_, trephine::Registration{}), thread_([this] { report_ = loop_.run_until(never_); }) {}
  ~Pushing() { (void)stop(); }
  Pushing(const Pushing&) = delete;
  Pushing& operator=(const Pushing&) = delete;

  trephine::RunReport stop() {
    loop_.stop();
    return finish();
  }
  /// Waits for the loop's own end.
  trephine::RunReport finish() {
    if (thread_.joinable()) thread_.join();
    return report_;
  }

 private:
  static trephine::test::ScriptedScene scene() {
    trephine::test::ScriptedScene pushing;
    pushing.wrench = {trephine::Vec3d(0, kForce, 0), trephine::Vec3d::Zero()};
    return pushing;
  }

  trephine::test::ScriptedScene scene_ = scene();
  bool (*never_)(const trephine::TickRecord&) = [](const trephine::TickRecord&) { return false; };
  trephine::ServoLoop<Device, trephine::test::ScriptedScene> loop_;
  trephine::RunReport report_;
  std::thread thread_;
};

inline double felt(const Service& service) { return service.witness().force.norm(); }
inline bool feels_all(const Service& service) { return felt(service) > 0.999 * Pushing::kForce; }

}  // namespace haply::test
