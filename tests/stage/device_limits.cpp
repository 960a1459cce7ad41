// SPDX-License-Identifier: MIT
#include <trephine/stage/device_limits.hpp>

#include "fakes.hpp"

#include <random>

using namespace trephine;
using namespace trephine::test;

namespace {

Wrenchd limited(const DeviceLimits& limits, Wrenchd w) {
  const TickInput input;
  limits.apply(touching(input), w);
  return w;
}

}  // namespace

TEST_CASE("limits: never above, direction kept, nothing below touched") {
  const DeviceLimits limits{.force = 3.3, .torque = 0.1};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  std::uniform_real_distribution<double> exponent(-320, 308);
  for (int i = 0; i < 5000; ++i) {
    const Vec3d direction = Vec3d{u(random), u(random), u(random)}.normalized();
    const Vec3d f = direction * std::pow(10.0, exponent(random));
    const Wrenchd out = limited(limits, {f, f});
    CHECK(out.force.norm() <= 3.3);
    CHECK(out.torque.norm() <= 0.1);
    if (f.norm() <= 0.1) CHECK(out == Wrenchd{f, f});
    if (f.norm() > 3.3) CHECK((out.force / 3.3 - direction).norm() < 1e-14);
    if (f.norm() > 0.1) CHECK((out.torque / 0.1 - direction).norm() < 1e-14);
  }
}

TEST_CASE("limits: force and torque apart") {
  const Wrenchd out = limited({.force = 1, .torque = 2}, {Vec3d(0, 0, 10), Vec3d(0, 1.5, 0)});
  CHECK((out.force - Vec3d(0, 0, 1)).norm() < 1e-14);
  CHECK(out.torque == Vec3d(0, 1.5, 0));
}

TEST_CASE("limits: extremes") {
  const DeviceLimits limits{.force = 2, .torque = 0.1};
  constexpr double kHuge = std::numeric_limits<double>::max();
  constexpr double kTiny = std::numeric_limits<double>::denorm_min();
  const Wrenchd huge = limited(limits, {Vec3d(kHuge, kHuge, -kHuge), Vec3d(0, -kHuge, 0)});
  CHECK((huge.force - 2 * Vec3d(1, 1, -1).normalized()).norm() < 1e-13);
  CHECK((huge.torque - Vec3d(0, -0.1, 0)).norm() < 1e-15);
  CHECK(limited(limits, {Vec3d(kTiny, 0, -kTiny), Vec3d(0, kTiny, 0)}) ==
        Wrenchd{Vec3d(kTiny, 0, -kTiny), Vec3d(0, kTiny, 0)});
  CHECK(limited(limits, {}) == Wrenchd{});
  // Left as they are: the scene sees them and answers by zero.
  CHECK(!is_finite(limited(limits, {Vec3d(kInf, 0, 0), Vec3d::Zero()})));
  CHECK(!is_finite(limited(limits, {Vec3d(1, -kInf, 0), Vec3d::Zero()})));
  CHECK(!is_finite(limited(limits, {Vec3d::Zero(), Vec3d(0, kNaN, 5)})));
  CHECK(!is_finite(limited({.force = kNaN, .torque = 0}, {Vec3d(1, 0, 0), Vec3d::Zero()})));
}

TEST_CASE("limits: zero is a limit; what is not given is not limited, bit by bit") {
  const Wrenchd w{Vec3d(1, 0, 0), Vec3d(1e-300, 1, 0)};
  CHECK(limited({.force = 3, .torque = 0}, w) == Wrenchd{w.force, Vec3d::Zero()});
  CHECK(limited({.force = 3}, w) == w);
  CHECK(limited({.torque = 0.5}, w).force == w.force);
  const Wrenchd large{Vec3d(1e308, -1e308, 1e308), Vec3d(-1e308, 0, 1e-320)};
  CHECK(limited({}, large) == large);
}

TEST_CASE("limits: validated by the scene") {
  auto bone = small_grid();
  CHECK(refusal([&] { HapticScene(bone, 300, Floor<>{}, DeviceLimits{.force = -1}); }) ==
        "trephine::DeviceLimits: force must be >= 0 N, got -1");
  CHECK(!refusal([&] { HapticScene(bone, 300, Floor<>{}, DeviceLimits{.force = kNaN}); }).empty());
  CHECK(!refusal([&] { HapticScene(bone, 300, Floor<>{}, DeviceLimits{.force = 1, .torque = -kInf}); }).empty());
  CHECK(!refusal([&] { HapticScene(bone, 300, Floor<>{}, DeviceLimits{.torque = kNaN}); }).empty());
  CHECK(refusal([&] { HapticScene(bone, 300, Floor<>{}, DeviceLimits{}); }).empty());
}
