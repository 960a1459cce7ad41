/* SPDX-License-Identifier: MIT */
/* The part of the HD interface that the adapter and its tests use, written for this project from the facts in public
 * manuals; implemented by the simulated device beside it. It is not OpenHaptics, holds nothing of its SDK and is not
 * affiliated with it. For tests and dry runs where the SDK is absent: never installed, never on a user's include path.
 *
 * Units: mm, N, mN·m, rad. Axes: +x right, +y up, +z toward the user. Matrices are column-major. */
#pragma once

#include <limits.h>
#include <stddef.h>

#define HDCALLBACK

typedef unsigned int HHD;
typedef unsigned int HDenum;
typedef unsigned int HDerror;
typedef unsigned int HDuint;
typedef unsigned char HDboolean;
typedef unsigned short HDushort;
typedef int HDint;
typedef long HDlong;
typedef unsigned long HDulong;
typedef float HDfloat;
typedef double HDdouble;
typedef const char* HDstring;
typedef unsigned int HDCallbackCode;
typedef unsigned int HDWaitCode;
typedef unsigned long HDSchedulerHandle;
typedef HDCallbackCode(HDCALLBACK* HDSchedulerCallback)(void* user);

typedef struct {
  HDerror errorCode;
  int internalErrorCode;
  HHD hHD;
} HDErrorInfo;

#define HD_DEVICE_ERROR(x) ((x).errorCode != HD_SUCCESS)

#define HD_FALSE 0
#define HD_TRUE 1
#define HD_CALLBACK_DONE 0
#define HD_CALLBACK_CONTINUE 1
#define HD_WAIT_CHECK_STATUS 0
#define HD_WAIT_INFINITE 1
#define HD_DEFAULT_DEVICE NULL
#define HD_INVALID_HANDLE 0xFFFFFFFF
#define HD_MAX_SCHEDULER_PRIORITY USHRT_MAX
#define HD_MIN_SCHEDULER_PRIORITY 0
#define HD_DEFAULT_SCHEDULER_PRIORITY ((HD_MAX_SCHEDULER_PRIORITY + HD_MIN_SCHEDULER_PRIORITY) / 2)

/* Errors */
#define HD_SUCCESS 0x0000
#define HD_INVALID_ENUM 0x0100
#define HD_INVALID_VALUE 0x0101
#define HD_INVALID_OPERATION 0x0102
#define HD_INVALID_INPUT_TYPE 0x0103
#define HD_BAD_HANDLE 0x0104
#define HD_WARM_MOTORS 0x0200
#define HD_EXCEEDED_MAX_FORCE 0x0201
#define HD_EXCEEDED_MAX_FORCE_IMPULSE 0x0202
#define HD_EXCEEDED_MAX_VELOCITY 0x0203
#define HD_FORCE_ERROR 0x0204
#define HD_DEVICE_FAULT 0x0300
#define HD_DEVICE_ALREADY_INITIATED 0x0301
#define HD_COMM_ERROR 0x0302
#define HD_COMM_CONFIG_ERROR 0x0303
#define HD_TIMER_ERROR 0x0304
#define HD_ILLEGAL_BEGIN 0x0400
#define HD_ILLEGAL_END 0x0401
#define HD_FRAME_ERROR 0x0402
#define HD_INVALID_PRIORITY 0x0500
#define HD_SCHEDULER_FULL 0x0501
#define HD_INVALID_LICENSE 0x0600

/* Parameters */
#define HD_CURRENT_BUTTONS 0x2000
#define HD_CURRENT_POSITION 0x2050
#define HD_CURRENT_VELOCITY 0x2051
#define HD_CURRENT_TRANSFORM 0x2052
#define HD_CURRENT_ANGULAR_VELOCITY 0x2053
#define HD_CURRENT_GIMBAL_ANGLES 0x2150
#define HD_VERSION 0x2500
#define HD_DEVICE_MODEL_TYPE 0x2501
#define HD_DEVICE_SERIAL_NUMBER 0x2504
#define HD_MAX_WORKSPACE_DIMENSIONS 0x2550
#define HD_USABLE_WORKSPACE_DIMENSIONS 0x2551
#define HD_INPUT_DOF 0x2553
#define HD_OUTPUT_DOF 0x2554
#define HD_CALIBRATION_STYLE 0x2555
#define HD_UPDATE_RATE 0x2600
#define HD_INSTANTANEOUS_UPDATE_RATE 0x2601
#define HD_NOMINAL_MAX_STIFFNESS 0x2602
#define HD_NOMINAL_MAX_FORCE 0x2603
#define HD_NOMINAL_MAX_CONTINUOUS_FORCE 0x2604
#define HD_MOTOR_TEMPERATURE 0x2605
#define HD_SOFTWARE_VELOCITY_LIMIT 0x2606
#define HD_SOFTWARE_FORCE_IMPULSE_LIMIT 0x2607
#define HD_FORCE_RAMPING_RATE 0x2608
#define HD_NOMINAL_MAX_DAMPING 0x2609
#define HD_NOMINAL_MAX_TORQUE_STIFFNESS 0x2620
#define HD_NOMINAL_MAX_TORQUE_DAMPING 0x2621
#define HD_NOMINAL_MAX_TORQUE_FORCE 0x2622
#define HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE 0x2623
#define HD_CURRENT_FORCE 0x2700
#define HD_CURRENT_TORQUE 0x2701
#define HD_CURRENT_JOINT_TORQUE 0x2703
#define HD_CURRENT_GIMBAL_TORQUE 0x2704

/* Capabilities that can be switched */
#define HD_FORCE_OUTPUT 0x4000
#define HD_MAX_FORCE_CLAMPING 0x4001
#define HD_FORCE_RAMPING 0x4002
#define HD_SOFTWARE_FORCE_LIMIT 0x4003
#define HD_ONE_FRAME_LIMIT 0x4004

#define HD_CALIBRATION_OK 0x5000
#define HD_CALIBRATION_NEEDS_UPDATE 0x5001
#define HD_CALIBRATION_NEEDS_MANUAL_INPUT 0x5002

#define HD_DEVICE_BUTTON_1 (1 << 0)
#define HD_DEVICE_BUTTON_2 (1 << 1)
#define HD_DEVICE_BUTTON_3 (1 << 2)
#define HD_DEVICE_BUTTON_4 (1 << 3)

#ifdef __cplusplus
extern "C" {
#endif

HHD hdInitDevice(HDstring name);
void hdDisableDevice(HHD device);
void hdMakeCurrentDevice(HHD device);
HHD hdGetCurrentDevice(void);
void hdBeginFrame(HHD device);
void hdEndFrame(HHD device);

void hdEnable(HDenum capability);
void hdDisable(HDenum capability);
HDboolean hdIsEnabled(HDenum capability);

void hdGetBooleanv(HDenum name, HDboolean* values);
void hdGetIntegerv(HDenum name, HDint* values);
void hdGetFloatv(HDenum name, HDfloat* values);
void hdGetDoublev(HDenum name, HDdouble* values);
void hdGetLongv(HDenum name, HDlong* values);
HDstring hdGetString(HDenum name);
void hdSetBooleanv(HDenum name, const HDboolean* values);
void hdSetIntegerv(HDenum name, const HDint* values);
void hdSetFloatv(HDenum name, const HDfloat* values);
void hdSetDoublev(HDenum name, const HDdouble* values);
void hdSetLongv(HDenum name, const HDlong* values);

HDErrorInfo hdGetError(void);
HDstring hdGetErrorString(HDerror code);

HDenum hdCheckCalibration(void);
HDenum hdCheckCalibrationStyle(void);
void hdUpdateCalibration(HDenum style);

void hdStartScheduler(void);
void hdStopScheduler(void);
void hdSetSchedulerRate(HDulong hertz);
HDdouble hdGetSchedulerTimeStamp(void);
HDSchedulerHandle hdScheduleAsynchronous(HDSchedulerCallback callback, void* user, HDushort priority);
void hdScheduleSynchronous(HDSchedulerCallback callback, void* user, HDushort priority);
void hdUnschedule(HDSchedulerHandle handle);
HDboolean hdWaitForCompletion(HDSchedulerHandle handle, HDWaitCode code);

#ifdef __cplusplus
}
#endif
