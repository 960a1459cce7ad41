# SPDX-License-Identifier: MIT
# Windows from Debian: MinGW builds, Wine runs.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
find_program(TREPHINE_WINE NAMES wine64 wine PATHS /usr/lib/wine REQUIRED)
set(CMAKE_CROSSCOMPILING_EMULATOR ${TREPHINE_WINE})
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(cross_root /usr/x86_64-w64-mingw32)
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
