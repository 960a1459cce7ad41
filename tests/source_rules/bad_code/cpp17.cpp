// SPDX-License-Identifier: MIT
// says: trephine needs C++20
// with: -std=c++17
#include <trephine/stage/haptic_scene.hpp>
