// SPDX-License-Identifier: MIT
// Names that X.h and Xlib.h define as macros.
#pragma once

#define Status int
#define Bool int
#define True 1
#define False 0
#define None 0L
#define Success 0
#define Always 2
#define Above 0
#define Below 1
#define Complex 0
#define Convex 2
#define Nonconvex 1
#define CoordModeOrigin 0
#define ControlMask (1 << 2)
#define CurrentTime 0L
#define CursorShape 0
#define DestroyAll 0
#define Expose 12
#define FocusIn 9
#define FocusOut 10
#define GrayScale 1
#define KeyPress 2
#define KeyRelease 3
#define Opposite 4
#define ParentRelative 1L
#define Unsorted 0
#define YXBanded 3
