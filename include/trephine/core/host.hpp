// SPDX-License-Identifier: MIT
#pragma once

/// Every other header includes this one before all else: it refuses in one sentence a host whose macros or flags would
/// end in hundreds of errors, or in wrong forces. After a refusal it includes a file that does not exist, which stops
/// the compiler there. Its one other task is the name of the namespace.

#if __cplusplus <= 201703L && (!defined(_MSVC_LANG) || _MSVC_LANG <= 201703L)
#error "trephine needs C++20: compile with -std=c++20 (MSVC: /std:c++20; CMake: link trephine::trephine)"
#include <trephine_stops_here>
#endif

#if defined(min) || defined(max)
#error "trephine: windows.h defined min and max as macros: define NOMINMAX before it (MSVC: /DNOMINMAX)"
#include <trephine_stops_here>
#endif

// Xlib.h defines Status, and X.h Success, which stops Eigen.
#if defined(Status) || (defined(Success) && !defined(EIGEN_WORLD_VERSION))
#error "trephine: X11 defined Status and Success as macros: include trephine before X11, or #undef both after it"
#include <trephine_stops_here>
#endif

// With the macro a tick still refuses what is not finite; a NaN among options may pass, and results differ by rounding.
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ && !defined(TREPHINE_ALLOW_FINITE_MATH)
#error "trephine: -ffast-math: add -fno-finite-math-only, or define TREPHINE_ALLOW_FINITE_MATH (see core/host.hpp)"
#include <trephine_stops_here>
#endif

#include <Eigen/Core>

// The name of the inline namespace that holds the library. Eigen aligns its types by flags such as -mavx, and by macros
// of its own: units that differ there have other layouts of one type, and must not share it. So they do not link.
#define TREPHINE_ALIGNED_(bytes) aligned_##bytes
#define TREPHINE_ALIGNED_TO(bytes) TREPHINE_ALIGNED_(bytes)
#define TREPHINE_ALIGNED TREPHINE_ALIGNED_TO(EIGEN_MAX_STATIC_ALIGN_BYTES)
