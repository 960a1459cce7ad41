// SPDX-License-Identifier: MIT
// The calls of the Force Dimension robotic SDK (DRD) that the adapter makes, declared anew from public documentation.
// Not affiliated with Force Dimension.
#pragma once

#include "dhdc.h"

extern "C" {

int drdOpenID(char ID);  // by index; the device's ID, or -1
int drdClose(char ID = -1);
bool drdIsSupported(char ID = -1);
bool drdIsInitialized(char ID = -1);
int drdAutoInit(char ID = -1);  // the motors move the handle
int drdStop(bool frc = false, char ID = -1);
}
