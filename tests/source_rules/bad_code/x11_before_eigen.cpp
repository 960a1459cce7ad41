// SPDX-License-Identifier: MIT
// says: include trephine before X11
#define Success 0
#include <trephine/core/units.hpp>
