// SPDX-License-Identifier: MIT
// The header of main.cpp again: what is not inline in it is then defined twice.
#include <trephine/compiled/scene.hpp>
