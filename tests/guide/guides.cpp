// SPDX-License-Identifier: MIT
#include <trephine/core/rotation.hpp>
#include <trephine/guide/guides.hpp>

#include "stage/fakes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <trephine/core/spatial.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/stage/remote.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 20;

// Central differences over 0.1 µm and 0.1 µrad; a kink of the slope, at most 6 k, within a difference costs 6 k h.
constexpr double kDifference = 1e-7;
constexpr double kGradientError = 5e-4;  // [N], [N·m]

class Random {
 public:
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vec3d vector(double size) { return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)}; }
  /// A pose about the axis of the options below: near, at the rims, and far.
  Posed pose() {
    const double scale = std::pow(10.0, (*this)(-4, -1));
    const double turn = std::pow(10.0, (*this)(-3, 0.6));
    return make_pose<double>(rotation_from_vector<double>(vector(turn)) * rotation_between<double>({0, 0, 1}, axis()),
                             point() + vector(scale));
  }
  static Vec3d axis() { return Vec3d(0.3, -0.2, 0.8).normalized(); }
  static Vec3d point() { return {0.01, -0.02, 0.03}; }

 private:
  std::mt19937 engine_{kSeed};
};

AxisGuide::Options axis_options(double radius = kInf, double angle = kInf) {
  return {.point_G = Random::point(),
          .axis_G = 7 * Random::axis(),
          .stiffness = 500,
          .angular_stiffness = 0.3,
          .force = 2,
          .torque = 0.06,
          .capture_radius = radius,
          .capture_angle = angle};
}

DepthStop::Options stop_options(double radius = kInf) {
  return {.point_G = Random::point(),
          .axis_G = 0.1 * Random::axis(),
          .reach = 1e-3,
          .stiffness = 800,
          .force = 3,
          .capture_radius = radius};
}

/// All shapes of the two laws: with and without an end, saturated before it and not.
std::vector<AxisGuide> axis_guides() {
  return {AxisGuide{axis_options()}, AxisGuide{axis_options(10e-3)}, AxisGuide{axis_options(2e-3)},
          AxisGuide{axis_options(kInf, 0.3)}, AxisGuide{axis_options(20e-3, 0.15)}};
}
std::vector<DepthStop> depth_stops() {
  return {DepthStop{stop_options()}, DepthStop{stop_options(10e-3)}, DepthStop{stop_options(1e-3)}};
}

template <class Guide>
Vec6d numeric_wrench(const Guide& guide, const Posed& X_GT) {
  Vec6d slope;
  for (Eigen::Index i = 0; i < 6; ++i) {
    Vec6d step = Vec6d::Zero();
    step[i] = kDifference;
    slope[i] = (guide.energy(moved(X_GT, -step)) - guide.energy(moved(X_GT, step))) / (2 * kDifference);
  }
  return slope;
}

Vec6d spatial(const Wrenchd& w) {
  Vec6d v;
  v << w.force, w.torque;
  return v;
}

/// Ticks until the gain is 1.
template <class Guide>
void raise(Guide& guide) {
  const TickInput input;
  Wrenchd unused;
  for (int tick = 0; tick < 2000; ++tick) guide.apply(touching(input), unused);
  REQUIRE(guide.gain() == 1);
}

template <class Guide>
Wrenchd wrench_of(Guide& guide, const Posed& X_WT, const Twist& twist_to_bone = {}, const Posed& X_WG = kBoneInWorld) {
  const TickInput input{.X_WT = X_WT};
  TickContext context = touching(input, kTick, X_WG);
  context.twist_to_bone = twist_to_bone;
  Wrenchd wrench;
  guide.apply(context, wrench);
  return wrench;
}

template <class Guide>
void check_gradient(const std::vector<Guide>& guides) {
  Random random;
  CAPTURE(kSeed);
  for (std::size_t g = 0; g < guides.size(); ++g)
    for (int i = 0; i < 3000; ++i) {
      const Posed X_GT = random.pose();
      const Vec6d error = spatial(guides[g].spring(X_GT)) - numeric_wrench(guides[g], X_GT);
      if (error.cwiseAbs().maxCoeff() > kGradientError) {
        CAPTURE(g);
        CAPTURE(error.transpose());
        CHECK(error.cwiseAbs().maxCoeff() <= kGradientError);
      }
    }
}

struct Loop {
  double work = 0;         // of the spring, over the greatest difference of energy on the path
  bool goes_free = false;  // the path leaves the capture
};

/// A closed path through the guide's point, on the axis.
template <class Guide>
Loop close_loop(const Guide& guide, double size, double turn) {
  constexpr int kSteps = 40000;
  const auto pose = [&](int i) {
    const double s = 2 * std::numbers::pi * i / kSteps;
    const Vec3d p = size * Vec3d(std::sin(s), std::sin(2 * s), 0.7 * std::sin(3 * s) - 0.4 * std::sin(s));
    const Vec3d w = turn * Vec3d(1 - std::cos(s), std::sin(2 * s), 0.5 * std::sin(s));
    return make_pose<double>(rotation_from_vector<double>(w) * rotation_between<double>({0, 0, 1}, Random::axis()),
                             Random::point() + p);
  };
  Loop loop;
  double least = kInf, most = -kInf;
  Posed before = pose(0);
  Wrenchd old = guide.spring(before);
  for (int i = 1; i <= kSteps; ++i) {
    const Posed now = pose(i);
    const Wrenchd w = guide.spring(now);
    loop.work += 0.5 * (old.force + w.force).dot(now.translation() - before.translation()) +
                 0.5 * (old.torque + w.torque).dot(turn_between<double>(before, now));
    loop.goes_free = loop.goes_free || (w == Wrenchd::zero() && old == Wrenchd::zero());
    least = std::min(least, guide.energy(now));
    most = std::max(most, guide.energy(now));
    before = now;
    old = w;
  }
  REQUIRE(most > least);
  loop.work = std::abs(loop.work) / (most - least);
  return loop;
}

/// The steepest change of the force along straight paths of 10 µm steps [N/m].
template <class Guide>
double steepest(const Guide& guide) {
  Random random;
  constexpr double kStep = 1e-5;
  double most = 0;
  for (int path = 0; path < 400; ++path) {
    Posed X_GT = random.pose();
    const double reach = 15e-3;
    X_GT.translation() = Random::point() + random.vector(reach);
    const Vec3d way = random.vector(1).normalized();
    Vec3d old = guide.spring(X_GT).force;
    for (int i = 0; i < 1500; ++i) {
      X_GT.translation() += kStep * way;
      const Vec3d now = guide.spring(X_GT).force;
      most = std::max(most, (now - old).norm() / kStep);
      old = now;
    }
  }
  return most;
}

}  // namespace

static_assert(Stage<AxisGuide> && Stage<DepthStop>);
static_assert(Tunable<AxisGuide> && Tunable<DepthStop>);
static_assert(kStageUsesTwist<AxisGuide> && kStageUsesTwist<DepthStop>);

TEST_CASE("the wrench of a guide is the negative gradient of its energy, in position and rotation") {
  check_gradient(axis_guides());
  check_gradient(depth_stops());
}

TEST_CASE("a guide does no work along closed paths, also through its capture") {
  // Trapezoids over 40000 steps.
  constexpr double kWorkError = 6.7e-6;
  double worst = 0;
  int free = 0;
  for (const double size : {1e-3, 4e-3, 15e-3})
    for (const double turn : {0.0, 0.1, 1.0}) {
      const auto check = [&](const auto& guides) {
        for (const auto& guide : guides) {
          const Loop loop = close_loop(guide, size, turn);
          worst = std::max(worst, loop.work);
          free += loop.goes_free ? 1 : 0;
        }
      };
      check(axis_guides());
      check(depth_stops());
    }
  CHECK(worst < kWorkError);
  CHECK(free > 20);
}

TEST_CASE("near the guide an axis guide is two linear springs; along the line and about it all is free") {
  for (const AxisGuide& guide : axis_guides()) {
    const Mat3d aligned = rotation_between<double>({0, 0, 1}, Random::axis());
    const Vec3d side = Random::axis().unitOrthogonal();
    for (const double along : {-0.1, 0.0, 0.3})
      for (const double spin : {0.0, 1.0, 3.0}) {
        const Mat3d R = rotation_from_vector<double>(spin * Random::axis()) * aligned;
        const Vec3d p = Random::point() + along * Random::axis();
        CHECK(guide.energy(make_pose<double>(R, p)) < 1e-20);
        const Wrenchd off = guide.spring(make_pose<double>(R, p + 0.5e-3 * side));
        CHECK((off.force - Vec3d(-500 * 0.5e-3 * side)).norm() < 1e-12);
        CHECK(off.torque.norm() < 1e-15);
        const Mat3d tilted = rotation_from_vector<double>(0.02 * side) * R;
        const Wrenchd leaning = guide.spring(make_pose<double>(tilted, p));
        CHECK(leaning.force.norm() < 1e-12);
        CHECK((leaning.torque - Vec3d(-0.3 * std::sin(0.02) * side)).norm() < 1e-15);
      }
  }
}

TEST_CASE("force and torque of a guide are bounded, and end at its capture") {
  Random random;
  CAPTURE(kSeed);
  double force = 0, torque = 0, push = 0;
  for (int i = 0; i < 20000; ++i) {
    const Posed X_GT = random.pose();
    for (const AxisGuide& guide : axis_guides()) {
      const Wrenchd w = guide.spring(X_GT);
      CHECK(is_finite(w));
      force = std::max(force, w.force.norm());
      torque = std::max(torque, w.torque.norm());
    }
    for (const DepthStop& stop : depth_stops()) {
      CHECK(stop.spring(X_GT).torque == Vec3d::Zero());
      push = std::max(push, stop.spring(X_GT).force.norm());
    }
  }
  CHECK(force <= 2 * (1 + 1e-12));
  CHECK(force > 1.99);
  CHECK(torque <= 0.06 * (1 + 1e-12));
  CHECK(torque > 0.059);
  CHECK(push <= 3 * (1 + 1e-12));
  CHECK(push > 2.99);

  const Mat3d aligned = rotation_between<double>({0, 0, 1}, Random::axis());
  const Vec3d side = Random::axis().unitOrthogonal();
  const AxisGuide captured{axis_options(10e-3)};
  const auto at_radius = [&](double r) { return make_pose<double>(aligned, Random::point() + r * side); };
  CHECK(captured.spring(at_radius(9.99e-3)).force.norm() > 0);
  CHECK(captured.spring(at_radius(10.01e-3)) == Wrenchd::zero());
  CHECK(captured.energy(at_radius(11e-3)) == captured.energy(at_radius(1)));
  const AxisGuide angled{axis_options(kInf, 0.3)};
  const auto at_angle = [&](double angle) {
    return make_pose<double>(rotation_from_vector<double>(angle * side) * aligned, Random::point());
  };
  CHECK(angled.spring(at_angle(0.299)).torque.norm() > 0);
  CHECK(angled.spring(at_angle(0.301)) == Wrenchd::zero());
  // Turned round, the axis has no side to turn to, and no torque.
  const AxisGuide open{axis_options()};
  CHECK(open.spring(at_angle(std::numbers::pi)).torque.norm() < 1e-16);
  CHECK(open.spring(at_angle(3.14)).torque.norm() < 1e-4);
}

TEST_CASE("forces of guides change no faster than stated") {
  // Rounding of forces over a step of 10 µm.
  constexpr double kRounding = 1e-6;
  for (const AxisGuide& guide : axis_guides()) CHECK(steepest(guide) <= 8.0 / 3 * 500 + kRounding);
  CHECK(steepest(axis_guides()[0]) <= 500 + kRounding);
  for (const DepthStop& stop : depth_stops()) CHECK(steepest(stop) <= 6 * 800 + kRounding);
  CHECK(steepest(depth_stops()[0]) <= 800 + kRounding);
  // Beyond stiffness times distance a step of 10 µm stays far below 0.1 N.
  for (const AxisGuide& guide : axis_guides()) CHECK((steepest(guide) - 500) * 1e-5 < 0.024);
  for (const DepthStop& stop : depth_stops()) CHECK((steepest(stop) - 800) * 1e-5 < 0.047);
}

TEST_CASE("a load moves the tool off the axis by load over stiffness, and no more than force over stiffness") {
  const Vec3d side = Random::axis().unitOrthogonal();
  for (const double load : {0.1, 1.0, 1.95}) {
    AxisGuide guide{axis_options()};
    raise(guide);
    Posed X = make_pose<double>(rotation_between<double>({0, 0, 1}, Random::axis()), Random::point());
    const Vec3d moment = 0.02 * load * side;
    for (int i = 0; i < 4000; ++i) {  // overdamped: steps along the wrench
      const Wrenchd w = wrench_of(guide, X);
      Vec6d step;
      step << 1e-4 * (w.force + load * side), 0.1 * (w.torque + moment);
      X = moved(X, step);
    }
    const Vec3d offset = X.translation() - Random::point();
    CHECK(offset.norm() == near(load / 500, 5.6e-13));
    CHECK(offset.norm() < 2.0 / 500);
    CHECK(std::asin(X.linear().col(2).cross(Random::axis()).norm()) == near(std::asin(0.02 * load / 0.3), 4.8e-13));
  }
}

TEST_CASE("damping dissipates, keeps the bounds, and does not act beyond the capture") {
  Random random;
  CAPTURE(kSeed);
  int damped = 0, free = 0;
  for (AxisGuide guide : axis_guides()) {
    AxisGuide::Options options = guide.options();
    options.damping = 5;
    options.angular_damping = 5e-3;
    AxisGuide damping{options};
    raise(guide);
    raise(damping);
    for (int i = 0; i < 2000; ++i) {
      const Posed X = random.pose();
      const Twist v{random.vector(0.5), random.vector(10)};
      const Wrenchd with = wrench_of(damping, X, v), without = wrench_of(guide, X, v);
      const double power = (with.force - without.force).dot(v.linear);
      const double angular_power = (with.torque - without.torque).dot(v.angular);
      CHECK(power <= 1e-12);
      CHECK(angular_power <= 1e-12);
      CHECK(with.force.norm() <= 2 * (1 + 1e-12));
      CHECK(with.torque.norm() <= 0.06 * (1 + 1e-12));
      (power < -1e-6 ? damped : free) += 1;
      if (guide.spring(X) == Wrenchd::zero()) CHECK(with == Wrenchd::zero());
    }
    // Along the line and about it nothing is damped.
    const Posed X = make_pose<double>(rotation_between<double>({0, 0, 1}, Random::axis()), Random::point());
    const Wrenchd along = wrench_of(damping, X, {0.3 * Random::axis(), 4 * Random::axis()});
    CHECK(along.force.norm() < 1e-14);
    CHECK(along.torque.norm() < 1e-15);
  }
  CHECK(damped > 500);
  CHECK(free > 500);
  for (DepthStop stop : depth_stops()) {
    DepthStop::Options options = stop.options();
    options.damping = 20;
    DepthStop damping{options};
    raise(stop);
    raise(damping);
    for (int i = 0; i < 2000; ++i) {
      const Posed X = random.pose();
      const Twist v{random.vector(0.5), random.vector(10)};
      const Wrenchd with = wrench_of(damping, X, v), without = wrench_of(stop, X, v);
      CHECK((with.force - without.force).dot(v.linear) <= 1e-12);
      CHECK(with.force.norm() <= 3 * (1 + 1e-12));
      CHECK(with.force.dot(without.force) >= 0);  // never pulls
      if (without.force == Vec3d::Zero()) CHECK(with.force == Vec3d::Zero());
    }
  }
}

TEST_CASE("a depth stop pushes back beyond its plane alone, in proportion to the depth") {
  DepthStop stop{stop_options()};
  raise(stop);
  const auto at_height = [&](double height, double aside = 0) {
    Posed X = Posed::Identity();
    X.translation() = Random::point() + height * Random::axis() + aside * Random::axis().unitOrthogonal();
    return X;
  };
  CHECK(wrench_of(stop, at_height(1.001e-3)) == Wrenchd::zero());
  for (const double aside : {0.0, 5e-3, 1.0}) {
    CHECK((wrench_of(stop, at_height(0.5e-3, aside)).force - Vec3d(800 * 0.5e-3 * Random::axis())).norm() < 1e-12);
    CHECK((wrench_of(stop, at_height(-1, aside)).force - Vec3d(3 * Random::axis())).norm() < 1e-9);
  }
  // A peg: full on its axis, up to half its radius, nothing beyond its side.
  const DepthStop peg{stop_options(10e-3)};
  for (const double height : {0.9e-3, 0.0, -2e-3, -3.9e-3})
    CHECK((peg.spring(at_height(height)).force - stop.spring(at_height(height)).force).norm() < 1e-9);
  CHECK(peg.spring(at_height(-2e-3, 10.01e-3)) == Wrenchd::zero());
  CHECK(std::abs(peg.spring(at_height(-20e-3, 9e-3)).force.dot(Random::axis())) < 1e-15);
  CHECK(peg.spring(at_height(-20e-3, 9e-3)).force.dot(Random::axis().unitOrthogonal()) > 0.1);
}

TEST_CASE("a jump fades each guide in anew") {
  const auto after = [](auto guide, const Posed& X, Status last) {
    const TickInput input{.X_WT = X};
    Wrenchd wrench;
    for (int tick = 0; tick <= 1000; ++tick) {
      TickContext context = touching(input);
      context.status = tick == 1000 ? last : Status::kOk;
      wrench = {};
      guide.apply(context, wrench);
    }
    return wrench.force.norm();
  };
  const AxisGuide axis{AxisGuide::Options{}};
  const DepthStop stop{DepthStop::Options{}};
  const Posed aside = at(2e-3, 0, 0), beyond = at(0, 0, -2e-3);
  CHECK(after(axis, aside, Status::kOk) == near(0.8));
  CHECK(after(axis, aside, Status::kJump) < 0.01);
  CHECK(after(stop, beyond, Status::kOk) == near(1.6));
  CHECK(after(stop, beyond, Status::kJump) < 0.01);
}

TEST_CASE("the gain rises and falls without a step when a guide is enabled, disabled, replaced or reset") {
  const Posed X = make_pose<double>(Mat3d::Identity(), Random::point() + Vec3d(8e-3, 0, 0));
  const AxisGuide::Options first = axis_options();
  AxisGuide guide{first};
  const double full = guide.spring(X).force.norm();
  REQUIRE(full > 1.9);
  // The greatest slope of the gain over a tick of a ramp of half a second.
  const double most = 1.5 * kTick / 0.5;
  Wrenchd before = Wrenchd::zero();
  int ticks = 0;
  const auto run = [&](double until) {
    for (ticks = 1; ticks <= 2000; ++ticks) {
      const Wrenchd now = wrench_of(guide, X);
      CHECK((now.force - before.force).norm() <= most * 2.0 + 1e-12);
      CHECK((now.torque - before.torque).norm() <= most * 0.06 + 1e-12);
      CHECK((now.force - guide.gain() * guide.spring(X).force).norm() < 1e-12);
      before = now;
      if (guide.gain() == until) return;
    }
    FAIL("the gain did not arrive");
  };
  CHECK(guide.gain() == 0);
  run(1);
  CHECK(ticks == near(500, 0.01));
  AxisGuide::Options off = first;
  off.enabled = false;
  guide.adopt(off);
  CHECK(guide.gain() == 1);
  run(0);
  CHECK(before == Wrenchd::zero());
  guide.adopt(first);
  run(1);
  // A new axis waits for the old one to fade.
  AxisGuide::Options second = first;
  second.point_G += Vec3d(16e-3, 0, 0);
  guide.adopt(second);
  const Vec3d old_force = before.force;
  CHECK(guide.options().point_G == second.point_G);
  CHECK((wrench_of(guide, X).force - old_force).norm() <= most * 2.0);
  before = wrench_of(guide, X);
  run(0);
  run(1);
  CHECK(before.force.dot(old_force) < 0);
  // A jump of the tool and a reset start anew.
  const TickInput input{.X_WT = X};
  TickContext context = touching(input);
  context.status = Status::kJump;
  Wrenchd jumped;
  guide.apply(context, jumped);
  CHECK(jumped.force.norm() <= most * 2.0);
  before = jumped;
  run(1);
  guide.reset();
  CHECK(guide.gain() == 0);
  // A stall of a tenth of a second moves the gain by its time, and no further.
  Wrenchd stalled;
  guide.apply(touching(input, 0.1), stalled);
  CHECK(guide.gain() == near(0.2 * 0.2 * 2.6));
}

TEST_CASE("guides move with the bone, add to the wrench, and allocate nothing") {
  const Posed X_WG = turned({0.4, -0.3, 0.9}, {0.2, 0.1, -0.3});
  AxisGuide guide{axis_options()};
  DepthStop stop{stop_options()};
  raise(guide);
  raise(stop);
  Random random;
  for (int i = 0; i < 500; ++i) {
    const Posed X_GT = random.pose();
    const Posed X_WT = X_WG * X_GT;
    CHECK((spatial(wrench_of(guide, X_WT, {}, X_WG)) - spatial(guide.spring(X_GT).rotated(X_WG.linear()))).norm() <
          1e-12);
    CHECK((spatial(wrench_of(stop, X_WT, {}, X_WG)) - spatial(stop.spring(X_GT).rotated(X_WG.linear()))).norm() <
          1e-12);
  }
  const TickInput input{.X_WT = X_WG};
  const TickContext context = touching(input, kTick, X_WG);
  Wrenchd wrench{Vec3d(1, 2, 3), Vec3d(0.1, 0.2, 0.3)};
  const Wrenchd own = guide.spring(Posed::Identity()).rotated(X_WG.linear());
  {
    const AllocationGuard guard;
    guide.apply(context, wrench);
    const auto allocations = guard.allocations();
    CHECK(allocations == 0);
  }
  CHECK((wrench.force - Vec3d(1, 2, 3) - own.force).norm() < 1e-14);
  CHECK((wrench.torque - Vec3d(0.1, 0.2, 0.3) - own.torque).norm() < 1e-15);
}

TEST_CASE("a scene takes guides, and another thread's options") {
  auto bone = small_grid(turned({0, 0.2, 0}, {0.1, 0, 0}));
  Mailbox<AxisGuide::Options> knob;
  AxisGuide::Options options{.point_G = {1e-3, 1e-3, 0}, .damping = 1};
  auto scene = HapticScene{bone,
                           300,
                           Floor<>{},
                           Remote{AxisGuide{options}, knob},
                           DepthStop{{.point_G = {0, 0, 3e-3}}},
                           DeviceLimits{.force = 3.3, .torque = 0.1}};
  const TickInput input{.X_WT = bone.X_WG() * at(3e-3, 1e-3, 2e-3)};
  TickResult r;
  for (int tick = 0; tick < 600; ++tick) r = scene.tick(input, kTick);
  CHECK(r.status == Status::kOk);
  // 400 N/m over 2 mm, and 800 N/m over 1 mm.
  CHECK((bone.X_WG().linear().transpose() * r.wrench.force - Vec3d(-0.8, 0, 0.8)).norm() < 1e-13);
  options.enabled = false;
  knob.post(options);
  for (int tick = 0; tick < 600; ++tick) r = scene.tick(input, kTick);
  CHECK((bone.X_WG().linear().transpose() * r.wrench.force - Vec3d(0, 0, 0.8)).norm() < 1e-14);
  scene.reset();
  CHECK(scene.tick(input, kTick).wrench.force.norm() < 2.8e-5);
  // Three degrees of freedom: the position alone.
  auto force_only = HapticScene{bone, 300, Floor<>{}, AxisGuide{{.point_G = {1e-3, 1e-3, 0}}}, ForceOnly{}};
  const TickInput leaning{.X_WT = bone.X_WG() * turned({0.3, 0, 0}, {3e-3, 1e-3, 2e-3})};
  for (int tick = 0; tick < 600; ++tick) r = force_only.tick(leaning, kTick);
  CHECK(r.wrench.force.norm() == near(0.8));
  CHECK(r.wrench.torque == Vec3d::Zero());
}

TEST_CASE("no tangent is stiffer than the options say, and a budget lowers the law as a whole") {
  Random random;
  // The derivative of the wrench along a step, against the step [N/m, N·m/rad]; what pushes onward is negative.
  const auto stiffest = [&](const auto& guide, bool turn) {
    constexpr double kStep = 1e-6;
    double most = 0;
    for (int n = 0; n < 20000; ++n) {
      const Posed X = random.pose();
      Vec6d step = Vec6d::Zero();
      step.segment<3>(turn ? 3 : 0) = random.vector(1).normalized();
      const Vec6d change =
          spatial(guide.spring(moved(X, Vec6d(-kStep * step)))) - spatial(guide.spring(moved(X, Vec6d(kStep * step))));
      most = std::max(most, change.dot(step) / (2 * kStep));
    }
    return most;
  };
  constexpr double kRounding = 1.001;
  std::vector<AxisGuide> axes = axis_guides();
  AxisGuide::Options axis = axis_options(10e-3);
  axis.damping = 3, axis.angular_damping = 1e-3;
  axis.budget = StiffnessBudget{.linear = 125, .angular = 0.1};
  axes.emplace_back(axis);
  CHECK(axes.back().options().stiffness == 125);
  CHECK(axes.back().options().force == 0.5);
  CHECK(axes.back().options().damping == 0.75);
  CHECK(axes.back().options().angular_stiffness == near(0.1));
  CHECK(axes.back().options().torque == near(0.02));
  for (const AxisGuide& guide : axes) {
    const double linear = stiffest(guide, false), angular = stiffest(guide, true);
    CHECK(linear <= kRounding * guide.options().stiffness);
    CHECK(linear > 0.9 * guide.options().stiffness);
    CHECK(angular <= kRounding * guide.options().angular_stiffness);
    CHECK(angular > 0.9 * guide.options().angular_stiffness);
  }
  std::vector<DepthStop> stops = depth_stops();
  DepthStop::Options stop = stop_options(10e-3);
  stop.budget = StiffnessBudget{.linear = 200, .angular = 0.1};
  stops.emplace_back(stop);
  CHECK(stops.back().options().force == 0.75);
  stops.front().adopt(stop);  // under way as at the start
  CHECK(stops.front().options().stiffness == 200);
  stops.front().reset();
  for (const DepthStop& guide : stops) {
    const double linear = stiffest(guide, false);
    CHECK(linear <= kRounding * guide.options().stiffness);
    CHECK(linear > 0.9 * guide.options().stiffness);
  }
  axis.budget->linear = kNaN;
  CHECK_THROWS_AS(AxisGuide{axis}, std::invalid_argument);
  stop.budget->angular = 0;
  CHECK_THROWS_AS(DepthStop{stop}, std::invalid_argument);
  // A generous budget changes no bit.
  AxisGuide::Options rich = axis_options();
  rich.budget = StiffnessBudget{1e5, 1e3};
  const Posed X = at(1, 2, 0.1);
  CHECK(AxisGuide{rich}.spring(X) == AxisGuide{axis_options()}.spring(X));
}

TEST_CASE("options out of range are refused") {
  const auto axis = [](auto change) {
    AxisGuide::Options o = axis_options();
    change(o);
    return refusal([&] { AxisGuide{o}; });
  };
  const auto stop = [](auto change) {
    DepthStop::Options o = stop_options();
    change(o);
    return refusal([&] { DepthStop{o}; });
  };
  const auto says = [](const std::string& text, const std::string& part) {
    INFO(text);
    CHECK(text.find(part) != std::string::npos);
  };
  CHECK(axis([](auto&) {}).empty());
  CHECK(stop([](auto&) {}).empty());
  for (const double bad : {-1.0, kNaN, kInf}) {
    says(axis([&](auto& o) { o.stiffness = bad; }), "AxisGuide: stiffness must be finite and >= 0 N/m");
    says(axis([&](auto& o) { o.angular_stiffness = bad; }), "angular_stiffness");
    says(axis([&](auto& o) { o.force = bad; }), "force");
    says(axis([&](auto& o) { o.torque = bad; }), "torque");
    says(axis([&](auto& o) { o.damping = bad; }), "damping");
    says(axis([&](auto& o) { o.angular_damping = bad; }), "angular_damping");
    says(axis([&](auto& o) { o.ramp = bad; }), "ramp");
    says(axis([&](auto& o) { o.point_G.x() = bad * 1e4; }), "point_G");
    says(stop([&](auto& o) { o.stiffness = bad; }), "DepthStop: stiffness");
    says(stop([&](auto& o) { o.force = bad; }), "force");
    says(stop([&](auto& o) { o.damping = bad; }), "damping");
    says(stop([&](auto& o) { o.reach = bad; }), "reach");
    says(stop([&](auto& o) { o.ramp = bad; }), "ramp");
  }
  says(stop([](auto& o) { o.reach = 1.5; }), "did you mean 1.5_mm");
  for (const double bad : {0.0, -1.0, kNaN}) {
    says(axis([&](auto& o) { o.capture_radius = bad; }), "capture_radius must be > 0 m");
    says(axis([&](auto& o) { o.capture_angle = bad; }), "capture_angle must be > 0 rad");
    says(stop([&](auto& o) { o.capture_radius = bad; }), "capture_radius must be > 0 m");
  }
  says(axis([](auto& o) { o.axis_G.setZero(); }), "axis_G must be finite and no zero vector");
  says(axis([](auto& o) { o.axis_G.x() = kNaN; }), "axis_G");
  says(axis([](auto& o) { o.ramp = 0.01; }), "ramp must be finite and >= 0.05 s");
  says(axis([](auto& o) {
         o.capture_radius = 1e-2;
         o.stiffness = 0;
       }),
       "a capture radius needs a stiffness");
  says(axis([](auto& o) {
         o.capture_angle = 0.1;
         o.torque = 0;
       }),
       "a capture angle needs an angular stiffness");
  // No spring is no force.
  AxisGuide none{{.stiffness = 0, .angular_stiffness = 0, .force = 0, .torque = 0}};
  raise(none);
  CHECK(wrench_of(none, at(1, 1, 1)) == Wrenchd::zero());
  DepthStop open{{.stiffness = 0, .force = 0, .damping = 3}};
  raise(open);
  CHECK(wrench_of(open, at(0, 0, -1), {Vec3d(1, 1, 1), Vec3d::Zero()}) == Wrenchd::zero());
}
