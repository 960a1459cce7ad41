// SPDX-License-Identifier: MIT
#include "support/near.hpp"

#include <trephine/tool/shape.hpp>

#include <doctest/doctest.h>

#include <limits>

using trephine::test::near;

namespace {

using trephine::Burr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST_CASE("a burr that is none is refused with what is wrong and what was given") {
  const auto check = [](double tip, double shaft, double length) {
    Burr{.tip_radius = tip, .shaft_radius = shaft, .shaft_length = length}.validate();
  };
  CHECK_NOTHROW(check(0.0015, 0.0008, 0.04));
  CHECK_THROWS_WITH(check(0, 0.0008, 0.04), "trephine::Burr: tip_radius must be > 0 m, got 0");
  CHECK_THROWS_WITH(check(-1, 0.0008, 0.04), "trephine::Burr: tip_radius must be > 0 m, got -1");
  CHECK_THROWS_WITH(check(kNan, 0.0008, 0.04), "trephine::Burr: tip_radius must be > 0 m, got nan");
  CHECK_THROWS_WITH(check(kInf, 0.0008, 0.04), "trephine::Burr: tip_radius must be > 0 m, got inf");
  CHECK_THROWS_WITH(check(0.0015, 0, 0.04), "trephine::Burr: shaft_radius must be > 0 m, got 0");
  CHECK_THROWS_WITH(check(0.0015, kNan, 0.04), "trephine::Burr: shaft_radius must be > 0 m, got nan");
  CHECK_THROWS_WITH(check(0.0015, 0.0008, -1), "trephine::Burr: shaft_length must be >= 0 m, got -1");
  CHECK_THROWS_WITH(check(0.0015, 0.0008, kNan), "trephine::Burr: shaft_length must be >= 0 m, got nan");
  CHECK_THROWS_WITH(check(0.0015, 0.0008, kInf), "trephine::Burr: shaft_length must be >= 0 m, got inf");
  CHECK_THROWS_WITH(check(0.0015, 0.0008, 0.0015),
                    "trephine::Burr: shaft_length must exceed tip_radius (or be 0: no shaft), got 0.0015");
}

TEST_CASE("lengths in millimetres are refused, with what was probably meant") {
  const auto check = [](double tip, double shaft, double length) {
    Burr{.tip_radius = tip, .shaft_radius = shaft, .shaft_length = length}.validate();
  };
  CHECK_NOTHROW(check(0.05, 0.05, 1));
  CHECK_THROWS_WITH(check(1.5, 0.0008, 0.04),
                    "trephine::Burr: tip_radius must be at most 0.05 m (did you mean 1.5_mm?), got 1.5");
  CHECK_THROWS_WITH(check(0.0015, 0.8, 0.04),
                    "trephine::Burr: shaft_radius must be at most 0.05 m (did you mean 0.8_mm?), got 0.8");
  CHECK_THROWS_WITH(check(0.0015, 0.0008, 40),
                    "trephine::Burr: shaft_length must be at most 1 m (did you mean 40_mm?), got 40");
}

TEST_CASE("a ball alone needs no shaft radius") {
  CHECK_NOTHROW((Burr{.tip_radius = 0.001, .shaft_radius = kNan, .shaft_length = 0}.validate()));
  CHECK_FALSE(Burr{.shaft_length = 0}.has_shaft());
  CHECK(Burr{}.has_shaft());
}

TEST_CASE("the shaft leaves the ball where the cylinder meets the sphere") {
  // 3-4-5: at 4 from the centre a ball of radius 5 is 3 thick.
  CHECK(Burr{.tip_radius = 0.005, .shaft_radius = 0.003}.shaft_emerges() == near(0.004));
  CHECK(Burr{.tip_radius = 0.003, .shaft_radius = 0.003}.shaft_emerges() == 0);
  CHECK(Burr{.tip_radius = 0.002, .shaft_radius = 0.003}.shaft_emerges() == 0);
}

}  // namespace
