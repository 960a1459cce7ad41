// SPDX-License-Identifier: MIT
// Sizes of tools are diameters, in options and in messages.
#include "parsed.hpp"
#include "temporal_bone.hpp"

#include "support/near.hpp"

#include <doctest/doctest.h>

#include <stdexcept>

using namespace drill;

TEST_CASE("options take diameters, and nothing that is printed says radius") {
  const Options options = parsed({"--burr-diameter", "3", "--shaft-diameter", "1.6"});
  CHECK(options.tip_radius == trephine::test::near(0.0015));
  CHECK(options.shaft_radius == trephine::test::near(0.0008));
  CHECK_THROWS_AS((void)parsed({"--tip-radius", "1.5"}), UsageError);
  CHECK_THROWS_AS((void)parsed({"--burr-diameter", "0"}), UsageError);
  CHECK(usage().find("radius") == std::string::npos);
  CHECK_THROWS_WITH_AS((void)temporal_bone::structures({.tip_radius = 8e-3}),
                       doctest::Contains("a burr of 16 mm diameter has no straight way"), std::runtime_error);
}
