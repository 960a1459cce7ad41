# SPDX-License-Identifier: MIT
# 64-bit Arm from Debian: a cross compiler builds, QEMU runs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(cross_root /usr/aarch64-linux-gnu)
set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64;-L;${cross_root}")
set(TREPHINE_TSAN_LINKS FALSE CACHE BOOL "")  # QEMU does not run it
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
