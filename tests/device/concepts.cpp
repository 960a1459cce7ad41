// SPDX-License-Identifier: MIT
// What a device must be, as archetypes: the least that satisfies each concept, and near misses that must not.
#include <doctest/doctest.h>

#include <trephine/device/pacing.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>

#include "device/archetypes.hpp"

#include <type_traits>

namespace {

using namespace trephine;

struct LeastDevice {
  DeviceCapabilities capabilities() const { return {}; }
  DeviceStatus read(DeviceState&) noexcept { return DeviceStatus::kOk; }
  DeviceStatus write(const Wrenchd&) noexcept { return DeviceStatus::kOk; }
};
static_assert(HapticDevice<LeastDevice>);
static_assert(!SelfPacedDevice<LeastDevice>);
static_assert(!AdvancedDevice<LeastDevice>);

struct ReadMayThrow : LeastDevice {
  DeviceStatus read(DeviceState&) { return DeviceStatus::kOk; }
};
struct WriteMayThrow : LeastDevice {
  DeviceStatus write(const Wrenchd&) { return DeviceStatus::kOk; }
};
struct AnswersBool : LeastDevice {
  bool read(DeviceState&) noexcept { return true; }
};
struct SaysNothing : LeastDevice {
  void write(const Wrenchd&) noexcept {}
};
struct WantsToChangeWrench : LeastDevice {
  DeviceStatus write(Wrenchd&) noexcept { return DeviceStatus::kOk; }
};
struct ReadsByValue : LeastDevice {
  DeviceState read() noexcept { return {}; }
};
struct ForceOnlyWrite : LeastDevice {
  DeviceStatus write(const Vec3d&) noexcept { return DeviceStatus::kOk; }
};
struct NoCapabilities {
  DeviceStatus read(DeviceState&) noexcept { return DeviceStatus::kOk; }
  DeviceStatus write(const Wrenchd&) noexcept { return DeviceStatus::kOk; }
};
struct CapabilitiesChangeIt : NoCapabilities {
  DeviceCapabilities capabilities() { return {}; }
};
static_assert(!HapticDevice<ReadMayThrow>);
static_assert(!HapticDevice<WriteMayThrow>);
static_assert(!HapticDevice<AnswersBool>);
static_assert(!HapticDevice<SaysNothing>);
static_assert(!HapticDevice<WantsToChangeWrench>);
static_assert(!HapticDevice<ReadsByValue>);
static_assert(!HapticDevice<ForceOnlyWrite>);
static_assert(!HapticDevice<NoCapabilities>);
static_assert(!HapticDevice<CapabilitiesChangeIt>);
static_assert(!HapticDevice<int>);

struct LeastSelfPaced : LeastDevice {
  DeviceStatus start(ServoCallback, void*) noexcept { return DeviceStatus::kOk; }
  void stop() noexcept {}
};
struct NoStop : LeastDevice {
  DeviceStatus start(ServoCallback, void*) noexcept { return DeviceStatus::kOk; }
};
struct StopMayThrow : NoStop {
  void stop() {}
};
struct CallbackWithoutArgument : LeastDevice {
  DeviceStatus start(bool (*)()) noexcept { return DeviceStatus::kOk; }
  void stop() noexcept {}
};
static_assert(SelfPacedDevice<LeastSelfPaced>);
static_assert(!SelfPacedDevice<NoStop>);
static_assert(!SelfPacedDevice<StopMayThrow>);
static_assert(!SelfPacedDevice<CallbackWithoutArgument>);

struct Advanced : LeastDevice {
  void advance(double) {}
};
struct SelfPacedAndAdvanced : LeastSelfPaced {
  void advance(double) {}
};
static_assert(AdvancedDevice<Advanced>);
static_assert(!AdvancedDevice<SelfPacedAndAdvanced>);  // it paces itself: the loop does not touch its time
static_assert(AdvancedDevice<SimulatedDevice<>>);

struct ThrowingScene {
  TickResult tick(const TickInput&, double) { return {}; }
};
struct WrenchScene {
  Wrenchd tick(const TickInput&, double) noexcept { return {}; }
};
static_assert(TickableScene<test::ScriptedScene>);
static_assert(TickableScene<test::FloorScene>);
static_assert(!TickableScene<ThrowingScene>);
static_assert(!TickableScene<WrenchScene>);

static_assert(Pacing<SleepPacing> && Pacing<SleepSpinPacing> && Pacing<NoPacing>);
static_assert(!Pacing<LeastDevice>);

static_assert(HandScript<StillHand>);
static_assert(!HandScript<double>);

// The types that the README writes are deduced.
static_assert(std::is_same_v<decltype(SimulatedDevice{SimulatedDeviceOptions{}}), SimulatedDevice<StillHand>>);
static_assert(
    std::is_same_v<decltype(ServoLoop{std::declval<LeastDevice&>(), std::declval<test::FloorScene&>(), Registration{}}),
                   ServoLoop<LeastDevice, test::FloorScene, SleepPacing>>);
static_assert(!std::is_copy_constructible_v<ServoLoop<LeastDevice, test::FloorScene>>);

TEST_CASE("device concepts: the archetype that satisfies them runs") {
  LeastDevice device;
  test::FloorScene scene;
  ServoOptions options;
  options.realtime.priority = 0;
  const RunReport report = ServoLoop{device, scene, Registration{}, options}.run_for(std::chrono::milliseconds(5));
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.ticks >= 1);
}

TEST_CASE("device status: ordered by severity, and has words") {
  CHECK(worse(DeviceStatus::kOk, DeviceStatus::kSafetyTrip) == DeviceStatus::kSafetyTrip);
  CHECK(worse(DeviceStatus::kFault, DeviceStatus::kSafetyTrip) == DeviceStatus::kFault);
  CHECK(std::string(to_string(DeviceStatus::kFault)) == "fault");
}

}  // namespace
