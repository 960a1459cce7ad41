// SPDX-License-Identifier: MIT
// What the adapter takes for granted about <HD/hd.h>, checked at compile time against the stand-in and, where there is
// one, against the SDK itself. Not affiliated with OpenHaptics.
#include <climits>
#include <cstddef>

#include <HD/hd.h>

#include <type_traits>
#include <utility>

namespace {

template <class A, class B>
inline constexpr bool kSame = std::is_same_v<A, B>;

// Types
static_assert(kSame<HHD, unsigned int> && kSame<HDenum, unsigned int> && kSame<HDerror, unsigned int>);
static_assert(kSame<HDuint, unsigned int> && kSame<HDboolean, unsigned char> && kSame<HDushort, unsigned short>);
static_assert(kSame<HDint, int> && kSame<HDlong, long> && kSame<HDulong, unsigned long>);
static_assert(kSame<HDfloat, float> && kSame<HDdouble, double> && kSame<HDstring, const char*>);
static_assert(kSame<HDCallbackCode, unsigned int> && kSame<HDWaitCode, unsigned int>);
static_assert(kSame<HDSchedulerHandle, unsigned long>);
static_assert(kSame<decltype(HDErrorInfo::errorCode), HDerror> && kSame<decltype(HDErrorInfo::internalErrorCode), int>);
static_assert(kSame<decltype(HDErrorInfo::hHD), HHD>);
static_assert(std::is_invocable_r_v<HDCallbackCode, HDSchedulerCallback, void*>);

// Functions
static_assert(kSame<decltype(hdInitDevice(nullptr)), HHD> && kSame<decltype(hdGetError()), HDErrorInfo>);
static_assert(kSame<decltype(hdBeginFrame(HHD{})), void> && kSame<decltype(hdEndFrame(HHD{})), void>);
static_assert(kSame<decltype(hdGetDoublev(HDenum{}, std::declval<HDdouble*>())), void>);
static_assert(kSame<decltype(hdGetIntegerv(HDenum{}, std::declval<HDint*>())), void>);
static_assert(kSame<decltype(hdSetDoublev(HDenum{}, std::declval<const HDdouble*>())), void>);
static_assert(kSame<decltype(hdCheckCalibration()), HDenum> && kSame<decltype(hdGetErrorString(HDerror{})), HDstring>);
static_assert(kSame<decltype(hdCheckCalibrationStyle()), HDenum> &&
              kSame<decltype(hdUpdateCalibration(HDenum{})), void>);
static_assert(kSame<decltype(hdScheduleAsynchronous(std::declval<HDSchedulerCallback>(), nullptr, HDushort{})),
                    HDSchedulerHandle>);
static_assert(kSame<decltype(hdUnschedule(HDSchedulerHandle{})), void>);
static_assert(kSame<decltype(hdStartScheduler()), void> && kSame<decltype(hdStopScheduler()), void>);

// Values
static_assert(HD_CALLBACK_DONE == 0 && HD_CALLBACK_CONTINUE == 1);
static_assert(HD_WAIT_CHECK_STATUS == 0 && HD_WAIT_INFINITE == 1);
static_assert(HD_INVALID_HANDLE == 0xFFFFFFFF);
static_assert(HD_MAX_SCHEDULER_PRIORITY == USHRT_MAX && HD_MIN_SCHEDULER_PRIORITY == 0);
static_assert(HD_DEFAULT_SCHEDULER_PRIORITY == USHRT_MAX / 2);
static_assert(HD_CURRENT_BUTTONS == 0x2000 && HD_CURRENT_POSITION == 0x2050 && HD_CURRENT_VELOCITY == 0x2051);
static_assert(HD_CURRENT_TRANSFORM == 0x2052 && HD_CURRENT_ANGULAR_VELOCITY == 0x2053);
static_assert(HD_CURRENT_GIMBAL_ANGLES == 0x2150 && HD_VERSION == 0x2500 && HD_DEVICE_MODEL_TYPE == 0x2501);
static_assert(HD_DEVICE_SERIAL_NUMBER == 0x2504 && HD_MAX_WORKSPACE_DIMENSIONS == 0x2550);
static_assert(HD_USABLE_WORKSPACE_DIMENSIONS == 0x2551 && HD_INPUT_DOF == 0x2553 && HD_OUTPUT_DOF == 0x2554);
static_assert(HD_CALIBRATION_STYLE == 0x2555 && HD_UPDATE_RATE == 0x2600 && HD_INSTANTANEOUS_UPDATE_RATE == 0x2601);
static_assert(HD_NOMINAL_MAX_STIFFNESS == 0x2602 && HD_NOMINAL_MAX_FORCE == 0x2603);
static_assert(HD_NOMINAL_MAX_CONTINUOUS_FORCE == 0x2604 && HD_MOTOR_TEMPERATURE == 0x2605);
static_assert(HD_SOFTWARE_VELOCITY_LIMIT == 0x2606 && HD_SOFTWARE_FORCE_IMPULSE_LIMIT == 0x2607);
static_assert(HD_FORCE_RAMPING_RATE == 0x2608 && HD_NOMINAL_MAX_DAMPING == 0x2609);
static_assert(HD_NOMINAL_MAX_TORQUE_STIFFNESS == 0x2620 && HD_NOMINAL_MAX_TORQUE_DAMPING == 0x2621);
static_assert(HD_NOMINAL_MAX_TORQUE_FORCE == 0x2622 && HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE == 0x2623);
static_assert(HD_CURRENT_FORCE == 0x2700 && HD_CURRENT_TORQUE == 0x2701 && HD_CURRENT_JOINT_TORQUE == 0x2703);
static_assert(HD_CURRENT_GIMBAL_TORQUE == 0x2704);
static_assert(HD_FORCE_OUTPUT == 0x4000 && HD_MAX_FORCE_CLAMPING == 0x4001 && HD_FORCE_RAMPING == 0x4002);
static_assert(HD_SOFTWARE_FORCE_LIMIT == 0x4003 && HD_ONE_FRAME_LIMIT == 0x4004);
static_assert(HD_CALIBRATION_OK == 0x5000 && HD_CALIBRATION_NEEDS_UPDATE == 0x5001);
static_assert(HD_CALIBRATION_NEEDS_MANUAL_INPUT == 0x5002);
static_assert(HD_DEVICE_BUTTON_1 == 1 && HD_DEVICE_BUTTON_2 == 2 && HD_DEVICE_BUTTON_3 == 4 && HD_DEVICE_BUTTON_4 == 8);

static_assert(HD_SUCCESS == 0 && HD_INVALID_ENUM == 0x100 && HD_INVALID_VALUE == 0x101);
static_assert(HD_INVALID_OPERATION == 0x102 && HD_INVALID_INPUT_TYPE == 0x103 && HD_BAD_HANDLE == 0x104);
static_assert(HD_WARM_MOTORS == 0x200 && HD_EXCEEDED_MAX_FORCE == 0x201 && HD_EXCEEDED_MAX_FORCE_IMPULSE == 0x202);
static_assert(HD_EXCEEDED_MAX_VELOCITY == 0x203 && HD_FORCE_ERROR == 0x204);
static_assert(HD_DEVICE_FAULT == 0x300 && HD_DEVICE_ALREADY_INITIATED == 0x301 && HD_COMM_ERROR == 0x302);
static_assert(HD_COMM_CONFIG_ERROR == 0x303 && HD_TIMER_ERROR == 0x304);
static_assert(HD_ILLEGAL_BEGIN == 0x400 && HD_ILLEGAL_END == 0x401 && HD_FRAME_ERROR == 0x402);
static_assert(HD_INVALID_PRIORITY == 0x500 && HD_SCHEDULER_FULL == 0x501 && HD_INVALID_LICENSE == 0x600);

}  // namespace
