// SPDX-License-Identifier: MIT
#include <trephine/stage/hunt_crossley.hpp>

#include "fakes.hpp"
#include "support/near.hpp"

#include <random>

using namespace trephine;
using namespace trephine::test;

namespace {

Wrenchd struck(const HuntCrossley& law, Wrenchd w, const Twist& v) {
  const TickInput input;
  auto c = touching(input);
  c.twist_to_bone = v;
  law.apply(c, w);
  return w;
}

}  // namespace

TEST_CASE("impact: F (1 + lambda * rate), harder going in, softer coming out") {
  const HuntCrossley law{{.lambda = 2}};
  const Wrenchd w{Vec3d(0, 0, 3), Vec3d(0.01, 0, 0)};
  const Wrenchd in = struck(law, w, {Vec3d(5, 0, -0.2), Vec3d::Zero()});  // 5 m/s along the surface does not count
  CHECK((in.force - Vec3d(0, 0, 3 * 1.4)).norm() < 1e-14);
  CHECK((in.torque - Vec3d(0.014, 0, 0)).norm() < 1e-16);  // same factor: the line of action stays
  const Wrenchd out = struck(law, w, {Vec3d(0, 0, 0.2), Vec3d::Zero()});
  CHECK((out.force - Vec3d(0, 0, 3 * 0.6)).norm() < 1e-14);
}

TEST_CASE("impact: at one contact anywhere on the tool the rate is that point's speed into the bone") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  const HuntCrossley law{{.lambda = 0.5, .max_factor = 10, .lever = 0.04}};
  for (int i = 0; i < 200; ++i) {
    const auto any = [&] { return Vec3d{u(random), u(random), u(random)}; };
    const Vec3d f = any();
    const Vec3d r = 0.04 * any().normalized();
    const Twist v{any(), 10 * any()};
    const double rate = -(v.linear + v.angular.cross(r)).dot(f.normalized());
    const double factor = std::clamp(1 + 0.5 * rate, 0.0, 10.0);
    const Wrenchd w = struck(law, Wrenchd::of_force_at(f, r), v);
    CHECK((w.force - factor * f).norm() < 1e-13);
    CHECK((w.torque - factor * r.cross(f)).norm() < 1e-15);
  }
}

TEST_CASE("impact: never pulls, and bounded, at any speed") {
  const HuntCrossley law{{.lambda = 1, .max_factor = 2}};
  const Wrenchd w{Vec3d(1, 2, 2), Vec3d::Zero()};
  for (const double speed : {0.0, 1e-300, 0.5, 1.0, 20.0, 1e6, 1e150}) {
    const Wrenchd out = struck(law, w, {speed * w.force.normalized(), Vec3d::Zero()});
    const Wrenchd in = struck(law, w, {-speed * w.force.normalized(), Vec3d::Zero()});
    CHECK(out.force.dot(w.force) >= 0);
    CHECK(out.force.norm() <= 3 * (1 + 1e-15));
    CHECK(in.force.norm() <= 6 * (1 + 1e-15));
    CHECK(in.force.norm() >= 3 * (1 - 1e-15));
  }
}

TEST_CASE("impact: a couple without a force is bounded too and does not flicker at rest") {
  const HuntCrossley law{{.lambda = 1, .max_factor = 2, .lever = 0.04}};
  const Wrenchd couple{Vec3d(1e-12, 0, 0), Vec3d(0, 0, 0.05)};
  const Wrenchd w = struck(law, couple, {Vec3d::Zero(), Vec3d(0, 0, -0.1)});  // 4 mm/s at the lever's end
  CHECK(w.torque.z() == near(0.05 * 1.004, 1e-12));
  CHECK(struck(law, {}, {Vec3d(1, 1, 1), Vec3d(1, 1, 1)}) == Wrenchd{});
}

TEST_CASE("impact: pressing in and out takes energy, lambda 0 does not") {
  // One press of a spring to depth D and back at 0.2 m/s: ∮F dz of k d (1 ± λ v) is −k D² λ v, ticks or not.
  const auto lost = [](double lambda) {
    auto bone = small_grid();
    auto scene = HapticScene{bone, 300, Floor<>{},
                             HuntCrossley{{.lambda = lambda, .lever = 2}}};  // the floor's lever arm is 2 m
    constexpr int kSteps = 50;
    constexpr double kStep = 0.2 * kTick;
    double work = 0;
    double before = 0;
    (void)scene.tick({.X_WT = at(0, 0, 0)}, kTick);
    for (int k = 1; k <= 2 * kSteps; ++k) {
      const double z = -kStep * (k <= kSteps ? k : 2 * kSteps - k);
      const double f = scene.tick({.X_WT = at(0, 0, z)}, kTick).wrench.force.z();
      work += f * (z - before);
      before = z;
    }
    return work;
  };
  constexpr double kDeep = 50 * 0.2 * kTick;
  const double spring = lost(0.0);  // what whole ticks make of a spring, the same in both
  CHECK(lost(1.0) - spring == near(-1000 * kDeep * kDeep * 0.2, 1e-14));
}

TEST_CASE("impact refuses what is out of range") {
  CHECK(refusal([] { HuntCrossley{{.lambda = kNaN}}; }).find("lambda must be finite and >= 0") != std::string::npos);
  CHECK(refusal([] { HuntCrossley{{.lambda = -1}}; }).find("got -1") != std::string::npos);
  CHECK(refusal([] { HuntCrossley{{.max_factor = 0.9}}; }).find("max_factor") != std::string::npos);
  CHECK(refusal([] { HuntCrossley{{.max_factor = kInf}}; }).find("max_factor") != std::string::npos);
  CHECK(refusal([] { HuntCrossley{{.lever = 0}}; }).find("lever") != std::string::npos);
  CHECK(refusal([] { HuntCrossley{{.lever = kNaN}}; }).find("lever") != std::string::npos);
}
