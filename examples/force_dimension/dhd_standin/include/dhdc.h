// SPDX-License-Identifier: MIT
// The calls of the Force Dimension haptic SDK (DHD) that the adapter makes, declared anew from public documentation for
// where the SDK is not installed. Not affiliated with Force Dimension.
#pragma once

#define DHD_ON 1
#define DHD_OFF 0

// Return values of success besides DHD_NO_ERROR.
#define DHD_TIMEGUARD 1        // no communication yet: the values are those of the last one
#define DHD_MOTOR_SATURATED 2  // less than what was asked for, in the same direction

// Elements of the status.
#define DHD_MAX_STATUS 17
#define DHD_STATUS_POWER 0
#define DHD_STATUS_CONNECTED 1
#define DHD_STATUS_RESET 3
#define DHD_STATUS_FORCE 5
#define DHD_STATUS_BRAKE 6
#define DHD_STATUS_ERROR 9
#define DHD_STATUS_WRIST_INIT 12
#define DHD_STATUS_FORCEOFFCAUSE 14

#define DHD_FORCEOFF_NONE 0
#define DHD_FORCEOFF_BUTTON 1
#define DHD_FORCEOFF_VELOCITY 2
#define DHD_FORCEOFF_WATCHDOG 3
#define DHD_FORCEOFF_SOFTWARE 4
#define DHD_FORCEOFF_USBDISCN 5
#define DHD_FORCEOFF_DEADMAN 6

#define DHD_MAX_BUTTONS 16

enum {
  DHD_NO_ERROR = 0,
  DHD_ERROR = 1,
  DHD_ERROR_COM = 2,
  DHD_ERROR_DHC_BUSY = 3,
  DHD_ERROR_NO_DRIVER_FOUND = 4,
  DHD_ERROR_NO_DEVICE_FOUND = 5,
  DHD_ERROR_NOT_AVAILABLE = 6,
  DHD_ERROR_TIMEOUT = 7,
  DHD_ERROR_GEOMETRY = 8,
  DHD_ERROR_EXPERT_MODE_DISABLED = 9,
  DHD_ERROR_DEVICE_NOT_READY = 12
};

extern "C" {

// The last error of the calling thread.
int dhdErrorGetLast();
const char* dhdErrorGetStr(int error);

int dhdGetDeviceCount();
const char* dhdGetSystemName(char ID = -1);
bool dhdIsLeftHanded(char ID = -1);
bool dhdHasWrist(char ID = -1);
bool dhdHasActiveWrist(char ID = -1);
bool dhdHasGripper(char ID = -1);

int dhdGetStatus(int status[DHD_MAX_STATUS], char ID = -1);
int dhdGetPositionAndOrientationFrame(double* px, double* py, double* pz, double matrix[3][3], char ID = -1);
int dhdGetLinearVelocity(double* vx, double* vy, double* vz, char ID = -1);
int dhdGetGripperAngleRad(double* a, char ID = -1);
unsigned int dhdGetButtonMask(char ID = -1);

int dhdEnableForce(unsigned char val, char ID = -1);
int dhdSetGravityCompensation(int val, char ID = -1);
int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double fg,
                                        char ID = -1);

int dhdEnableExpertMode();
int dhdDisableExpertMode();
int dhdSetWatchdog(unsigned char val, char ID = -1);  // in 125 µs; expert mode
}
