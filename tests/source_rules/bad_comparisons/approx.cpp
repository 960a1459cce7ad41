// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

TEST_CASE("a micrometre is no millimetre") { CHECK(1e-6 == doctest::Approx(1e-3)); }
