// SPDX-License-Identifier: MIT
// Each fault leaves no force within 10 ms, sends none again, and says what to do.
#include "force_dimension/fixture.hpp"

#include <doctest/doctest.h>

#include <set>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using dhd_standin::Fault;

/// The promise to the hand, and the resolution of a tick's sum.
constexpr double kSoon = 0.010 + 1e-9;

}  // namespace

TEST_CASE("Force Dimension faults: no force within 10 ms at any moment, and none after it") {
  struct Row {
    Fault fault;
    const char* says;
  };
  for (const Row& row : {Row{Fault::kUnplugged, "check its cable"}, Row{Fault::kCommunication, "check its cable"},
                         Row{Fault::kNoNumber, "pose that is none"}, Row{Fault::kNoRotation, "pose that is none"},
                         Row{Fault::kMirrored, "pose that is none"}, Row{Fault::kStale, "no new pose in time"},
                         Row{Fault::kError, "reports an error"}}) {
    CAPTURE(row.says);
    for (int phase = 0; phase < 5; ++phase) {  // of the looks at the status
      Bench b(rigid("sigma.7"));
      b.start();
      b.ticks(phase);
      REQUIRE(seen().felt == b.push);
      const double began = dhd_standin::now();
      dhd_standin::inject(row.fault);
      b.ticks(30);
      CHECK(b.read == DeviceStatus::kFault);
      CHECK(seen().felt == Wrenchd::zero());
      CHECK(seen().felt_until - began <= kSoon);
      CHECK(b.device->fault_text().find(row.says) != std::string::npos);
      // What cannot be reached keeps its last command, which only its watchdog ends.
      const bool reached = row.fault != Fault::kUnplugged && row.fault != Fault::kCommunication;
      if (reached) CHECK(seen().command == Wrenchd::zero());
    }
  }
}

TEST_CASE("Force Dimension faults: an error that passes does not bring the old force back at once") {
  Bench b(rigid("sigma.7"));
  b.start();
  dhd_standin::inject(Fault::kCommunication);
  b.ticks(20);
  dhd_standin::inject(Fault::kNone);
  CHECK(seen().felt == Wrenchd::zero());
  CHECK(b.ticks(10) == DeviceStatus::kSafetyTrip);  // its watchdog has braked it
  CHECK(seen().felt == Wrenchd::zero());
  b.start();
  CHECK(b.tick() == DeviceStatus::kOk);
}

TEST_CASE("Force Dimension faults: a jump is a trip at once, and another one on its way back") {
  Bench b(rigid("sigma.7"));
  b.start();
  for (const Fault fault : {Fault::kJump, Fault::kNone}) {
    dhd_standin::inject(fault);
    CHECK(b.tick() == DeviceStatus::kSafetyTrip);
    CHECK(b.device->trip() == force_dimension::Trip::kJump);
    CHECK(seen().felt == Wrenchd::zero());
    CHECK(b.ticks(3) == DeviceStatus::kOk);
  }
}

TEST_CASE("Force Dimension faults: lost calibration ends the force within 10 ms, though the pose moves by little") {
  Bench b(rigid("sigma.7"));
  b.start();
  const double began = dhd_standin::now();
  dhd_standin::inject(Fault::kUncalibrated);
  b.ticks(30);
  CHECK(b.read == DeviceStatus::kSafetyTrip);
  CHECK(b.device->trip() == force_dimension::Trip::kUncalibrated);
  CHECK(seen().felt_until - began <= kSoon);
  CHECK(seen().command == Wrenchd::zero());
}

TEST_CASE("Force Dimension faults: each code says what to do, with the driver's words where it is the driver's") {
  using namespace force_dimension;
  std::set<std::string> texts;
  for (const int code : std::vector<int>{DHD_NO_ERROR, DHD_ERROR_COM, DHD_ERROR_DHC_BUSY, DHD_ERROR_NO_DRIVER_FOUND,
                                         DHD_ERROR_NO_DEVICE_FOUND, DHD_ERROR_NOT_AVAILABLE, kNonFiniteCommand, kNoPose,
                                         kStalePose, kUnpowered, kDeviceError, 999})
    CHECK(texts.insert(advice(code)).second);
  for (const Trip trip : {Trip::kNone, Trip::kUncalibrated, Trip::kBrake, Trip::kButton, Trip::kJump, Trip::kLate})
    CHECK(texts.insert(advice(trip)).second);
  CHECK(describe(DHD_ERROR_COM) ==
        "communication with the device was lost: check its cable and power, then start again (driver's error 2, "
        "communication lost)");
  CHECK(describe(kNoPose).find("driver") == std::string::npos);
  CHECK(describe(DHD_NO_ERROR) == "no error");
}
