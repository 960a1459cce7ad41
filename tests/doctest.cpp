// SPDX-License-Identifier: MIT
// The body of doctest, apart from main.cpp: also for programs that have a main of their own and read the precompiled
// header, which has doctest in it.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
