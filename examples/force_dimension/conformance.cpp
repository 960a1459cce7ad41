// SPDX-License-Identifier: MIT
// What the adapter takes for granted about dhdc.h and drdc.h, checked at compile time against the stand-in and, where
// there is one, against the SDK itself. Not affiliated with Force Dimension.
#include <dhdc.h>
#include <drdc.h>

#include <type_traits>
#include <utility>

namespace {

/// True if the expression's type is R: what the call returns.
template <class R, class Actual>
inline constexpr bool kReturns = std::is_same_v<R, Actual>;
using Doubles = double*;

static_assert(kReturns<int, decltype(dhdErrorGetLast())> && kReturns<const char*, decltype(dhdErrorGetStr(0))>);
static_assert(kReturns<int, decltype(dhdGetDeviceCount())>);
static_assert(kReturns<const char*, decltype(dhdGetSystemName(char{}))>);
static_assert(kReturns<bool, decltype(dhdIsLeftHanded(char{}))> && kReturns<bool, decltype(dhdHasWrist(char{}))>);
static_assert(kReturns<bool, decltype(dhdHasActiveWrist(char{}))> && kReturns<bool, decltype(dhdHasGripper(char{}))>);
static_assert(kReturns<int, decltype(dhdGetStatus(std::declval<int*>(), char{}))>);
static_assert(kReturns<int, decltype(dhdGetPositionAndOrientationFrame(Doubles{}, Doubles{}, Doubles{},
                                                                       std::declval<double (*)[3]>(), char{}))>);
static_assert(kReturns<int, decltype(dhdGetLinearVelocity(Doubles{}, Doubles{}, Doubles{}, char{}))>);
static_assert(kReturns<int, decltype(dhdGetGripperAngleRad(Doubles{}, char{}))>);
static_assert(kReturns<unsigned int, decltype(dhdGetButtonMask(char{}))>);
static_assert(kReturns<int, decltype(dhdSetForceAndTorqueAndGripperForce(0., 0., 0., 0., 0., 0., 0., char{}))>);
static_assert(kReturns<int, decltype(dhdEnableForce(DHD_ON, char{}))>);
static_assert(kReturns<int, decltype(dhdSetGravityCompensation(DHD_ON, char{}))>);
static_assert(kReturns<int, decltype(dhdEnableExpertMode())> && kReturns<int, decltype(dhdDisableExpertMode())>);
static_assert(kReturns<int, decltype(dhdSetWatchdog(static_cast<unsigned char>(80), char{}))>);
static_assert(kReturns<int, decltype(drdOpenID(char{}))> && kReturns<int, decltype(drdClose(char{}))>);
static_assert(kReturns<bool, decltype(drdIsSupported(char{}))> && kReturns<bool, decltype(drdIsInitialized(char{}))>);
static_assert(kReturns<int, decltype(drdAutoInit(char{}))> && kReturns<int, decltype(drdStop(true, char{}))>);

static_assert(DHD_ON == 1 && DHD_OFF == 0 && DHD_TIMEGUARD == 1 && DHD_MOTOR_SATURATED == 2);
static_assert(DHD_MAX_STATUS > DHD_STATUS_FORCEOFFCAUSE && DHD_MAX_BUTTONS <= 16);
static_assert(DHD_STATUS_POWER == 0 && DHD_STATUS_CONNECTED == 1 && DHD_STATUS_RESET == 3 && DHD_STATUS_FORCE == 5);
static_assert(DHD_STATUS_BRAKE == 6 && DHD_STATUS_ERROR == 9 && DHD_STATUS_WRIST_INIT == 12);
static_assert(DHD_STATUS_FORCEOFFCAUSE == 14);
static_assert(DHD_FORCEOFF_BUTTON == 1 && DHD_FORCEOFF_VELOCITY == 2 && DHD_FORCEOFF_WATCHDOG == 3);
static_assert(DHD_FORCEOFF_DEADMAN == 6);
static_assert(DHD_NO_ERROR == 0 && DHD_ERROR_COM == 2 && DHD_ERROR_DHC_BUSY == 3 && DHD_ERROR_NO_DRIVER_FOUND == 4);
static_assert(DHD_ERROR_NO_DEVICE_FOUND == 5 && DHD_ERROR_NOT_AVAILABLE == 6 && DHD_ERROR_TIMEOUT == 7);
static_assert(DHD_ERROR_DEVICE_NOT_READY == 12);

}  // namespace
