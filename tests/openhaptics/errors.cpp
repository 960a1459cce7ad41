// SPDX-License-Identifier: MIT
#include "openhaptics_errors.hpp"

#include <doctest/doctest.h>

#include <set>
#include <string>
#include <vector>

using namespace openhaptics;
using trephine::DeviceStatus;

TEST_CASE("OpenHaptics errors: trips pass, everything else stops, also what nobody knows") {
  for (const HDerror trip : std::vector<HDerror>{HD_WARM_MOTORS, HD_EXCEEDED_MAX_FORCE, HD_EXCEEDED_MAX_FORCE_IMPULSE,
                                                 HD_EXCEEDED_MAX_VELOCITY, HD_FORCE_ERROR})
    CHECK(status_of(trip) == DeviceStatus::kSafetyTrip);
  for (const HDerror fault : std::vector<HDerror>{
           HD_DEVICE_FAULT, HD_DEVICE_ALREADY_INITIATED, HD_COMM_ERROR, HD_COMM_CONFIG_ERROR, HD_TIMER_ERROR,
           HD_ILLEGAL_BEGIN, HD_ILLEGAL_END, HD_FRAME_ERROR, HD_INVALID_PRIORITY, HD_SCHEDULER_FULL, HD_INVALID_LICENSE,
           HD_INVALID_ENUM, HD_INVALID_VALUE, HD_INVALID_OPERATION, HD_INVALID_INPUT_TYPE, HD_BAD_HANDLE, 0x7777})
    CHECK(status_of(fault) == DeviceStatus::kFault);
  CHECK(status_of(kNonFiniteCommand) == DeviceStatus::kFault);
  CHECK(status_of(kNonFinitePose) == DeviceStatus::kFault);
  CHECK(status_of(HD_SUCCESS) == DeviceStatus::kOk);
}

TEST_CASE("OpenHaptics errors: each says what to do, with the driver's code and words") {
  CHECK(describe(HD_COMM_ERROR) ==
        "communication with the device was lost: check its cable and power, then start again (driver's error 0x0302, "
        "communication error)");
  CHECK(describe(0x7777).find("0x7777") != std::string::npos);
  CHECK(describe(HD_SUCCESS) == "no error");
  CHECK(describe(kNonFiniteCommand).find("driver") == std::string::npos);
  std::set<std::string> texts;
  for (const HDerror code :
       std::vector<HDerror>{HD_WARM_MOTORS, HD_EXCEEDED_MAX_FORCE, HD_EXCEEDED_MAX_VELOCITY, HD_DEVICE_FAULT,
                            HD_DEVICE_ALREADY_INITIATED, HD_COMM_ERROR, HD_COMM_CONFIG_ERROR, HD_TIMER_ERROR,
                            HD_FRAME_ERROR, HD_SCHEDULER_FULL, HD_INVALID_LICENSE, HD_BAD_HANDLE})
    CHECK(texts.insert(advice(code)).second);
}
