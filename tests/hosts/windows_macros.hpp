// SPDX-License-Identifier: MIT
// Names that windows.h defines as macros, but min and max, which NOMINMAX keeps from it.
#pragma once

#define near
#define far
#define NEAR
#define FAR
#define pascal
#define cdecl
#define small char
#define hyper long long
#define interface struct
#define IN
#define OUT
#define OPTIONAL
#define CONST const
#define VOID void
#define CALLBACK
#define WINAPI
#define STRICT 1
#define PURE = 0
#define THIS
#define TRUE 1
#define FALSE 0
#define ERROR 0
#define NO_ERROR 0L
#define DELETE (0x00010000L)
#define INFINITE 0xFFFFFFFF
#define IGNORE 0
#define TRANSPARENT 1
#define OPAQUE 2
#define ABSOLUTE 1
#define RELATIVE 2
#define ALTERNATE 1
#define DIFFERENCE 11
#define DOMAIN 1
#define OVERFLOW 3
#define UNDERFLOW 4
#define PASSTHROUGH 19
#define VERTEX 1
#define rad1 0x0420
#define chx1 0x0410
#define edt1 0x0480
#define grp1 0x0430
#define stc1 0x0440
#define cmb1 0x0470
#define CreateWindow CreateWindowA
#define DeviceCapabilities DeviceCapabilitiesA
#define DrawText DrawTextA
#define GetMessage GetMessageA
#define GetObject GetObjectA
#define LoadImage LoadImageA
#define SendMessage SendMessageA
#define Yield()
#define ZeroMemory(destination, length)
