// SPDX-License-Identifier: MIT
#include "arguments.hpp"

#include <doctest/doctest.h>

#include <vector>

using namespace openhaptics;

namespace {

Arguments parsed(std::vector<const char*> words) {
  words.insert(words.begin(), "openhaptics_drill");
  return parse_arguments(static_cast<int>(words.size()), words.data());
}

}  // namespace

TEST_CASE("openhaptics_drill: arguments") {
  const Arguments none = parsed({});
  CHECK(none.seconds == 0);
  CHECK(none.scale == 1);
  CHECK(none.algorithm == Algorithm::kLine);
  CHECK(none.device.empty());
  const Arguments all =
      parsed({"--seconds", "2.5", "--device", "Left", "--algorithm", "surface", "--skull", "d", "--scale", "0.5"});
  CHECK(all.seconds == 2.5);
  CHECK(all.device == "Left");
  CHECK(all.algorithm == Algorithm::kSurface);
  CHECK(parsed({"--algorithm", "coupled"}).algorithm == Algorithm::kCoupled);
  CHECK(parsed({"--tool", "match-head-3"}).algorithm == Algorithm::kCoupled);
  CHECK(parsed({"--tool", "twist-2.5", "--algorithm", "coupled"}).tool == "twist-2.5");
  CHECK(none.tool.empty());
  CHECK(all.skull == "d");
  CHECK(all.scale == 0.5);
  CHECK(parsed({"-h"}).help);
  for (const auto& wrong : std::vector<std::vector<const char*>>{{"--seconds"},
                                                                 {"--seconds", "-1"},
                                                                 {"--seconds", "inf"},
                                                                 {"--seconds", "3s"},
                                                                 {"--algorithm", "Line"},
                                                                 {"--device", ""},
                                                                 {"--tool", "ball-3"},
                                                                 {"--tool", "pear-2", "--algorithm", "line"},
                                                                 {"--algorithm", "surface", "--tool", "pear-2"},
                                                                 {"--scale", "3"},
                                                                 {"drill"}})
    CHECK_THROWS_AS((void)parsed(wrong), UsageError);
}
