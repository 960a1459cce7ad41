// SPDX-License-Identifier: MIT
// says: define NOMINMAX before it
#define min(a, b) ((a) < (b) ? (a) : (b))
#define max(a, b) ((a) > (b) ? (a) : (b))
#include <trephine/stage/haptic_scene.hpp>
