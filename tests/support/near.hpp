// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

namespace trephine::test {

/// Compares by relative error alone. Approx by itself adds an absolute tolerance, under which milliseconds and
/// micrometres are all alike.
inline doctest::Approx near(double expected, double relative = 1e-9) {
  return doctest::Approx(expected).epsilon(relative).scale(0);
}

}  // namespace trephine::test
