// SPDX-License-Identifier: MIT
// says: add -fno-finite-math-only
// with: -ffast-math
#include <trephine/stage/haptic_scene.hpp>
