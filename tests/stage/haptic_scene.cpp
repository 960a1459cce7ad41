// SPDX-License-Identifier: MIT
#include <trephine/stage/haptic_scene.hpp>

#include <trephine/stage/damping.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/milling_vibration.hpp>

#include "fakes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <cstring>
#include <numbers>
#include <random>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr double kDeep = -2e-3;  // 2 N of the floor's spring

auto full_scene(VoxelGrid<std::int16_t>& bone) {
  return HapticScene{bone,
                     300,
                     Floor<>{},
                     Witness{},
                     HuntCrossley{{.lambda = 1}},
                     MillingVibration{{.frequency = 150}},
                     Damping{{.linear = 2, .angular = 0.01}},
                     FirstOrderFilter{{.cutoff = 200}},
                     DeviceLimits{.force = 3.3, .torque = 0.1}};
}

/// A path in and out of the floor with turns.
TickInput on_path(int k) {
  const double t = 1e-3 * k;
  return {.X_WT = turned({0.3 * std::sin(7 * t), 0.2 * t, std::cos(3 * t)},
                         {0.01 * std::sin(9 * t), 0.02 * t, 2e-3 * std::sin(20 * t)}),
          .spindle_on = k % 400 < 300};
}

/// A renderer that gives cuts at once a speed, as the coupled tool does.
struct Waiting {
  Posed X = Posed::Identity();
  [[nodiscard]] Posed cutting_pose(double = 0) const noexcept { return X; }
};

TEST_CASE("the path of a cutting pose that waits counts its own time") {
  constexpr double kTick25us = 25e-6, kWait = 40 * kTick25us;
  const auto way = [&](double moved, bool waits) {
    trephine::detail::CuttingPose<true, false> pose;
    Waiting renderer;
    CutTick tick{.continues = true, .dt = kTick25us};
    const CutKind kind = waits ? CutKind::kAtOnce : CutKind::kAtRate;
    static_cast<void>(pose.next(renderer, kind, 0, tick, false));
    renderer.X.translation().x() = moved;
    double longest = 0;
    for (int t = 0; t < 42; ++t) {  // a bite is due after 40, or by rounding 41
      const trephine::detail::CutStroke now = pose.next(renderer, kind, 0, tick, false);
      longest = std::max(longest, (now.to.translation() - now.from.translation()).norm());
    }
    return longest;
  };
  // A pose that jumps has no path.
  const double far = 0.9 * kMaxSpeed * kWait;
  CHECK(way(far, true) == far);
  CHECK(way(far, false) == 0);
  CHECK(way(1.1 * kMaxSpeed * kWait, true) == 0);
}

}  // namespace

TEST_CASE("a scene of a renderer alone passes its wrench, summary and status on") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}};
  (void)scene.tick({.X_WT = at(0, 0, 1e-3)}, kTick);
  const TickResult r = scene.tick({.X_WT = at(0, 0, kDeep)}, kTick);
  CHECK(r.wrench == Wrenchd{Vec3d(0, 0, 2), Vec3d(4, 0, 0)});
  CHECK(r.contact.count == 1);
  CHECK(r.contact.depth == 2e-3);
  CHECK(r.status == Status::kOk);
  CHECK(r.removed_mm3 == 0);
  scene.renderer().status = Status::kWorkBound;
  CHECK(scene.tick({.X_WT = at(0, 0, kDeep)}, kTick).status == Status::kWorkBound);
  CHECK(scene.tick({.X_WT = at(0, 0, 1)}, kTick).wrench == Wrenchd{});
}

TEST_CASE("a tool that stays where no hand works is told, at every tick's length, wherever the bone lies") {
  for (const double dt : {1e-3, 1.0 / 4000}) {
    auto bone = small_grid();
    const Vec3d there(0.5, -0.2, 0.1);
    bone.set_X_WG(turned({0.3, 0.1, -0.4}, there));
    auto scene = HapticScene{bone, 300, Floor<>{}};
    const auto seconds_until_told = [&](const Vec3d& p) {
      for (int k = 1; k * dt < 3; ++k)
        if (scene.tick({.X_WT = turned(Vec3d::Zero(), p)}, dt).status == Status::kFarAway) return k * dt;
      return 3.0;
    };
    CHECK(seconds_until_told(there + Vec3d(0, 0, 16)) == near(1, 1e-3));
    scene.reset();  // as a replay begins
    CHECK(seconds_until_told(there + Vec3d(0, 0, 16)) == near(1, 1e-3));
    CHECK(scene.tick({.X_WT = turned(Vec3d::Zero(), there + Vec3d(0, 0, 1))}, dt).status ==
          Status::kOk);  // back, and told anew
    CHECK(seconds_until_told(there + Vec3d(3, 0, 0)) == near(1, 1e-3));
    CHECK(seconds_until_told(there + Vec3d(1.9, 0, 0)) == 3);
  }
}

TEST_CASE("a wrench where nothing was known of the bone is flagged: at a start, after a reset, where densities rose") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}};
  const TickInput free{.X_WT = at(0, 0, 1e-3)}, in_bone{.X_WT = at(0, 0, kDeep)};
  const auto status = [&](const TickInput& input) { return scene.tick(input, kTick).status; };
  CHECK(status(in_bone) == Status::kStartedInside);
  CHECK(status(in_bone) == Status::kOk);
  scene.reset();
  CHECK(status({.X_WT = at(kNaN, 0, 0)}) == Status::kBadInput);  // looks at no bone
  CHECK(status(in_bone) == Status::kStartedInside);
  scene.reset();
  CHECK(status(free) == Status::kOk);
  CHECK(status(in_bone) == Status::kOk);
  (void)bone.lower_row(0, 0, 0, 3, [](int, std::int16_t) { return std::int16_t{-5}; });
  bone.commit();
  CHECK(status(in_bone) == Status::kOk);
  CHECK(bone.restore() == 0);
  CHECK(status(in_bone) == Status::kStartedInside);
  CHECK(status(in_bone) == Status::kOk);
  scene.renderer().status = Status::kJump;  // says more
  scene.reset();
  CHECK(status(in_bone) == Status::kJump);
}

TEST_CASE("stages run in listed order") {
  auto bone = small_grid();
  const TickInput input{.X_WT = at(0, 0, 1)};
  CHECK(HapticScene{bone, 300, Floor<>{}, Add{1}, Times{2}}.tick(input, kTick).wrench.force.x() == 2);
  CHECK(HapticScene{bone, 300, Floor<>{}, Times{2}, Add{1}}.tick(input, kTick).wrench.force.x() == 1);
  CHECK(HapticScene{bone, 300, Floor<>{}, Add{1}, Times{9}, DeviceLimits{.force = 4}}
            .tick(input, kTick)
            .wrench.force.x() == near(4, 1e-14));
}

TEST_CASE("the renderer's scalar is its own: float renderers answer the same to float rounding") {
  auto bone = small_grid(turned({0.2, 1, -0.4}, {50, -20, 7}));
  auto in_double = HapticScene{bone, 300, Floor<double>{}};
  auto in_float = HapticScene{bone, 300, Floor<float>{}};
  const TickInput input{.X_WT = bone.X_WG() * turned({1, 0, 0}, {0.1, 0.1, kDeep})};
  const Wrenchd d = in_double.tick(input, kTick).wrench;
  const Wrenchd f = in_float.tick(input, kTick).wrench;
  CHECK((d.force - f.force).norm() < 5.4e-12);
  CHECK((d.torque - f.torque).norm() < 1e-11);
  CHECK(d.force.norm() == near(2, 1e-11));
}

TEST_CASE("a grid that moves together with the tool gives the same wrench, rotated along") {
  auto still_bone = small_grid();
  auto moving_bone = small_grid();
  auto still = HapticScene{still_bone, 300, Floor<>{}, HuntCrossley{{.lambda = 1}},
                           Damping{{.linear = 2, .angular = 0.01, .only_in_contact = true}}};
  auto moving = HapticScene{moving_bone, 300, Floor<>{}, HuntCrossley{{.lambda = 1}},
                            Damping{{.linear = 2, .angular = 0.01, .only_in_contact = true}}};
  double largest = 0;
  for (int k = 0; k < 1000; ++k) {
    const TickInput input = on_path(k);
    // The moving pair also travels and turns: 0.3 m/s, 0.8 rad/s.
    const Posed X_WG = turned({8e-4 * k, 0.4, -0.1}, {3e-4 * k, -2, 5});
    moving_bone.set_X_WG(X_WG);
    const TickResult a = still.tick(input, kTick);
    const TickResult b = moving.tick({.X_WT = X_WG * input.X_WT, .spindle_on = input.spindle_on}, kTick);
    CHECK((X_WG.linear() * a.wrench.force - b.wrench.force).norm() < 5.5e-12);
    CHECK((X_WG.linear() * a.wrench.torque - b.wrench.torque).norm() < 2.5e-12);
    CHECK(a.contact.count == b.contact.count);
    largest = std::max(largest, a.wrench.force.norm());
  }
  CHECK(largest > 1);
}

TEST_CASE("twists: in the world and to the bone") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, Look{}};
  const Look& look = scene.part<Look>();
  (void)scene.tick({.X_WT = at(0, 0, 1)}, kTick);
  CHECK(look.twist.linear == Vec3d::Zero());  // nothing before it
  (void)scene.tick({.X_WT = turned({0, 0, 0.002}, {0.001, 0, 1})}, kTick);
  CHECK((look.twist.linear - Vec3d(1, 0, 0)).norm() < 1e-9);
  CHECK((look.twist.angular - Vec3d(0, 0, 2)).norm() < 1e-14);
  CHECK((look.twist_to_bone.linear - look.twist.linear).norm() < 1e-9);
  // Now the bone goes, and the tool stays.
  bone.set_X_WG(at(0, 0.0015, 0));
  (void)scene.tick({.X_WT = turned({0, 0, 0.002}, {0.001, 0, 1})}, 2 * kTick);
  CHECK(look.twist.linear.norm() < 1e-9);
  CHECK((look.twist_to_bone.linear - Vec3d(0, -0.75, 0)).norm() < 1e-9);
  CHECK(look.dt == 2 * kTick);
  CHECK(look.X_WG.matrix() == at(0, 0.0015, 0).matrix());
  bone.set_X_WG(at(0, 0.5, 0));  // put elsewhere, which is no velocity
  (void)scene.tick({.X_WT = turned({0, 0, 0.002}, {0.001, 0, 1})}, kTick);
  CHECK(look.twist_to_bone.linear == Vec3d::Zero());
}

TEST_CASE("gaps: no twist and no way to carve along after bad input, a jump, a bad dt, a reset, a leap") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, Witness{.probe = true}, Look{}};
  const Look& look = scene.part<Look>();
  const Witness& witness = scene.part<Witness>();
  double x = 0;
  const auto step = [&](double dt = kTick, double by = 1e-3) {
    x += by;
    (void)scene.tick({.X_WT = at(x, 0, 1)}, dt);
    const bool moving = look.twist.linear.x() > 0;
    CHECK(moving == (witness.before.translation().x() < witness.now.translation().x()));
    CHECK(witness.now.translation().x() == x);
    if (moving) CHECK(look.twist.linear.x() == near(by / dt));
    CHECK(is_finite(look.twist_to_bone.linear));
    return moving;
  };
  CHECK(!step());
  CHECK(step());
  x += 5e-3;  // the hand goes on meanwhile
  CHECK(scene.tick({.X_WT = at(kNaN, 0, 1)}, kTick).status == Status::kBadInput);
  CHECK(!step());
  CHECK(step());
  scene.renderer().status = Status::kJump;
  CHECK(!step());
  scene.renderer().status = Status::kStartedInside;
  CHECK(step());
  scene.renderer().status = Status::kOk;
  for (const double dt : {kNaN, 0.0, -1.0, 1e-9, 10.0, kInf}) {
    CHECK(!step(dt));
    CHECK(look.dt >= kShortestDt);
    CHECK(look.dt <= kLongestDt);
    CHECK(step());
  }
  scene.reset();
  CHECK(!step());
  CHECK(step());
  CHECK(!step(kTick, 0.03));  // 30 m/s
  CHECK(step());
  CHECK(step(kLongestDt, 0.1));
}

TEST_CASE("bad input: zero wrench, nothing called, states kept, the next good tick goes on") {
  auto bone = small_grid();
  auto scene = full_scene(bone);
  auto twin = full_scene(bone);
  int good = 0;
  const auto compare = [&] {
    const TickInput input = on_path(good++);
    const TickResult a = scene.tick(input, kTick);
    const TickResult b = twin.tick(input, kTick);
    CHECK(a.status == Status::kOk);
    return (a.wrench.force - b.wrench.force).norm() + (a.wrench.torque - b.wrench.torque).norm();
  };
  for (int k = 0; k < 200; ++k) CHECK(compare() == 0);

  std::vector<Posed> bad;
  for (const double value : {kNaN, kInf, -kInf, 1e30, -1e30, 1e300}) {
    for (int i = 0; i < 3; ++i) {
      bad.push_back(on_path(good).X_WT);
      bad.back().translation()[i] = value;
      bad.push_back(on_path(good).X_WT);
      bad.back().linear()(i, 1) = value;
    }
  }
  bad.push_back(make_pose<double>(Mat3d::Zero(), Vec3d::Zero()));
  bad.push_back(make_pose<double>(-Mat3d::Identity(), Vec3d::Zero()));
  bad.push_back(make_pose<double>(2 * Mat3d::Identity(), Vec3d::Zero()));
  for (const Posed& X : bad) {
    const int renders = scene.renderer().renders;
    const int carves = scene.part<Witness>().calls;
    const TickResult r = scene.tick({.X_WT = X, .spindle_on = true}, kTick);
    CHECK(r.status == Status::kBadInput);
    CHECK(r.wrench == Wrenchd{});
    CHECK(r.contact.count == 0);
    CHECK(r.removed_mm3 == 0);
    CHECK(scene.renderer().renders == renders);
    CHECK(scene.part<Witness>().calls == carves);
    // The filter rises again from the zero that was sent, by 1 − exp(−2π 200 Hz 1 ms) of up to 3.3 N in this tick, and
    // this tick's twist is missing.
    CHECK(compare() < 0.285 * 3.3 + 0.1);
    for (int k = 0; k < 40; ++k) (void)compare();
    CHECK(compare() < 1e-12);
  }
  CHECK(scene.renderer().resets == 0);
}

TEST_CASE("denormal and zero poses are good input") {
  auto bone = small_grid();
  auto scene = full_scene(bone);
  for (const double tiny : {0.0, -0.0, 5e-324, -1e-310}) {
    const TickResult r = scene.tick({.X_WT = at(tiny, tiny, tiny), .spindle_on = true}, kTick);
    CHECK(r.status == Status::kOk);
    CHECK(is_finite(r.wrench));
    CHECK(r.wrench.force.norm() < 1e-12);
  }
}

TEST_CASE("any dt gives a finite, limited wrench") {
  auto bone = small_grid();
  auto scene = full_scene(bone);
  std::mt19937 random(3);
  const std::array<double, 11> intervals{0.0, -1.0, kNaN, 1e-9, 10.0, kInf, -kInf, 5e-324, 1e-3, 1e-5, 0.1};
  for (int k = 0; k < 5000; ++k) {
    const TickResult r = scene.tick(on_path(k), intervals[random() % intervals.size()]);
    CHECK(r.status == Status::kOk);
    CHECK(r.wrench.force.norm() <= 3.3);
    CHECK(r.wrench.torque.norm() <= 0.1);
  }
}

TEST_CASE("a law that overflows: zero wrench, all state anew, the next tick is good") {
  auto bone = small_grid();
  auto scene = HapticScene{
      bone, 300, Floor<>{}, Witness{}, FirstOrderFilter{{.cutoff = 1}}, Look{}, Times{}, DeviceLimits{.force = 3}};
  const TickInput input{.X_WT = at(0, 0, kDeep), .spindle_on = true};
  const auto check_bad = [&](int resets) {
    const TickResult r = scene.tick(input, kTick);
    CHECK(r.status == Status::kNonFinite);
    CHECK(r.wrench == Wrenchd{});
    CHECK(scene.renderer().resets == resets);
    CHECK(scene.part<Look>().resets == resets);
    CHECK(scene.part<Witness>().resets == resets);
  };
  const auto check_good = [&] {
    const TickResult r = scene.tick(input, kTick);
    CHECK(r.status == Status::kStartedInside);  // the wrench belongs behind a ramp
    // The filter began at zero again.
    CHECK(r.wrench.force.z() == near(-2 * std::expm1(-2 * std::numbers::pi * kTick), 1e-12));
  };
  check_good();
  for (const double bad : {kNaN, kInf, -kInf}) {
    const int resets = scene.renderer().resets;
    const int carves = scene.part<Witness>().calls;
    scene.renderer().overflow = bad;  // in the renderer: neither cut nor stages see it
    check_bad(resets + 1);
    CHECK(scene.part<Witness>().calls == carves);
    scene.renderer().overflow = 0;
    check_good();
    scene.part<Times>().factor = bad;  // in a stage
    scene.part<Witness>().answer_mm3 = 0.5;
    const TickResult r = scene.tick(input, kTick);
    CHECK(r.status == Status::kNonFinite);
    CHECK(r.wrench == Wrenchd{});
    CHECK(r.removed_mm3 == 0.5);  // that much bone is gone all the same
    scene.part<Times>().factor = 1;
    check_good();
    scene.part<Witness>().answer_mm3 = bad;  // in the cut
    check_bad(resets + 3);
    scene.part<Witness>().answer_mm3 = 0;
    check_good();
    scene.part<DeviceLimits>().force = kNaN;  // a limit spoilt after construction lets nothing through
    check_bad(resets + 4);
    scene.part<DeviceLimits>().force = 3;
    check_good();
    scene.reset();
  }
  for (const Status own : {Status::kBadInput, Status::kNonFinite}) {  // the renderer's own verdict counts as well
    scene.renderer().status = own;
    check_bad(scene.renderer().resets + 1);
    scene.renderer().status = Status::kOk;
    check_good();
  }
  scene.renderer().overflow = 1e200;  // finite: limited
  const TickResult r = scene.tick(input, kTick);
  CHECK(r.status == Status::kOk);
  CHECK(r.wrench.force.norm() == near(3, 1e-14));
}

TEST_CASE("a cut gets the cutting pose or the probe, the raw force, and its volume is reported") {
  auto bone = small_grid(turned({0, 0, 1}, {2, 0, 0}));
  auto scene = HapticScene{bone, 0.5, Floor<float>{}, Witness{.probe = false, .answer_mm3 = 0.25}, Times{7}, Look{}};
  const auto tool_at = [&](double x, double z) {
    return TickInput{.X_WT = bone.X_WG() * at(x, 0, z), .spindle_on = true};
  };
  (void)scene.tick(tool_at(0, 1.75 * kDeep), kTick);
  const TickResult r = scene.tick(tool_at(5e-4, 2 * kDeep), kTick);
  const Witness& witness = scene.part<Witness>();
  CHECK(witness.calls == 2);
  CHECK((witness.before.translation() - Vec3d(0, 0, 0)).norm() < 1e-6);
  CHECK((witness.now.translation() - Vec3d(5e-4, 0, 0)).norm() < 7.1e-11);  // on the surface, where the proxy is
  CHECK(witness.context.force_N == near(4, 1e-4));
  CHECK(witness.context.spindle_on);
  CHECK(witness.context.cuts);
  CHECK(witness.context.dt == kTick);
  CHECK(witness.isovalue == 0.5);
  CHECK(r.removed_mm3 == 0.25);
  CHECK(scene.part<Look>().removed_mm3 == 0.25);
  scene.part<Witness>().probe = true;
  (void)scene.tick(tool_at(1e-3, 2 * kDeep), kTick);
  CHECK((witness.before.translation() - Vec3d(5e-4, 0, 2 * kDeep)).norm() < 1e-15);
  CHECK((witness.now.translation() - Vec3d(1e-3, 0, 2 * kDeep)).norm() < 1e-14);
}

TEST_CASE("a cut waits while contact could not be evaluated") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 0.5, Floor<>{}, Witness{.answer_mm3 = 0.25}};
  for (const bool evaluated : {true, false, true}) {
    scene.renderer().evaluated = evaluated;
    (void)scene.tick({.X_WT = at(0, 0, kDeep), .spindle_on = true}, kTick);
    CHECK(scene.part<Witness>().context.cuts == evaluated);
  }
}

TEST_CASE("a cut never sees a cutting pose, a depth or a force that is not finite, nor a leap of the proxy as a way") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, ForceOnly{}, Witness{}};
  Witness& witness = scene.part<Witness>();
  Floor<>& floor = scene.renderer();
  double x = 0;
  const auto tick = [&] {
    x += 1e-3;
    return scene.tick({.X_WT = at(x, 0, kDeep), .spindle_on = true}, kTick);
  };
  const auto way = [&] { return (witness.now.translation() - witness.before.translation()).norm(); };
  (void)tick();
  (void)tick();
  CHECK(way() == near(1e-3));
  floor.cut_aside = 0.05;
  (void)tick();
  CHECK(way() == 0);
  CHECK(witness.now.translation().x() == near(x + 0.05));
  witness.probe = true;  // the probe did not leap
  floor.cut_aside = 0;
  (void)tick();
  CHECK(way() == near(1e-3));
  for (const double bad : {kNaN, kInf}) {
    const int calls = witness.calls;
    floor.cut_aside = bad;
    CHECK(tick().status == Status::kNonFinite);
    floor.cut_aside = 0;
    floor.depth_error = bad;
    const TickResult r = tick();
    CHECK(r.status == Status::kNonFinite);
    CHECK(r.contact.depth == 0);
    floor.depth_error = 0;
    CHECK(witness.calls == calls);
    CHECK(tick().status == Status::kStartedInside);
    CHECK(way() == 0);
  }
  constexpr double kHuge = 1.7e308;
  floor.k = kHuge;
  floor.overflow = kHuge;
  CHECK(scene.tick({.X_WT = at(0, 0, -1), .spindle_on = true}, kTick).status == Status::kJump);
  CHECK(witness.context.force_N == std::numeric_limits<double>::max());
}

TEST_CASE("force only: no torque, whatever the stages say, and the forces bit-equal") {
  auto bone = small_grid();
  auto both = HapticScene{bone, 300, Floor<>{}, Damping{{.linear = 2, .angular = 1}}, DeviceLimits{.force = 3}};
  auto force_only =
      HapticScene{bone, 300, Floor<>{}, ForceOnly{}, Damping{{.linear = 2, .angular = 1}}, DeviceLimits{.force = 3}};
  static_assert(decltype(both)::kHasTorque && !decltype(force_only)::kHasTorque);
  for (int k = 0; k < 500; ++k) {
    const TickResult a = both.tick(on_path(k), kTick);
    const TickResult b = force_only.tick(on_path(k), kTick);
    CHECK(a.wrench.force == b.wrench.force);
    CHECK(b.wrench.torque == Vec3d::Zero());
  }
  auto unlimited = HapticScene{bone, 300, Floor<>{}, ForceOnly{}, Damping{{.angular = 1}}};
  (void)unlimited.tick(on_path(0), kTick);
  CHECK(unlimited.tick(on_path(1), kTick).wrench.torque == Vec3d::Zero());
  unlimited.renderer().torque_overflow = kInf;  // what nobody asked for cannot spoil the force
  CHECK(unlimited.tick(on_path(1), kTick).status == Status::kOk);
}

TEST_CASE("what is left out leaves the rest as it was, bit by bit") {
  auto bone = small_grid();
  auto with = HapticScene{bone, 300, Floor<>{}, Witness{}, Look{}, DeviceLimits{.force = 3, .torque = 1}};
  auto without = HapticScene{bone, 300, Floor<>{}, DeviceLimits{.force = 3, .torque = 1}};
  for (int k = 0; k < 500; ++k) CHECK(with.tick(on_path(k), kTick).wrench == without.tick(on_path(k), kTick).wrench);
}

TEST_CASE("two runs give the same bits") {
  const auto run = [] {
    auto bone = small_grid(turned({1, 2, 3}, {0.1, 0, 0}));
    auto scene = full_scene(bone);
    std::vector<Wrenchd> out;
    for (int k = 0; k < 2000; ++k) {
      TickInput input = on_path(k);
      input.X_WT = bone.X_WG() * input.X_WT;
      if (k % 97 == 0) input.X_WT.translation().x() = kNaN;
      out.push_back(scene.tick(input, kTick * (1 + 0.3 * std::sin(k))).wrench);
    }
    return out;
  };
  const auto a = run();
  const auto b = run();
  CHECK(std::memcmp(a.data(), b.data(), a.size() * sizeof(Wrenchd)) == 0);
}

TEST_CASE("reset makes a scene as good as new") {
  auto bone = small_grid();
  auto used = full_scene(bone);
  for (int k = 0; k < 333; ++k) (void)used.tick(on_path(k), kTick);
  used.reset();
  CHECK(used.renderer().resets == 1);
  auto fresh = full_scene(bone);
  for (int k = 100; k < 400; ++k) {
    const bool equal = used.tick(on_path(k), kTick).wrench == fresh.tick(on_path(k), kTick).wrench;
    if (k >= 150) CHECK(equal);  // the filter goes on from the last wrench, and has forgotten it by then
  }
}

TEST_CASE("poses and contacts in the world") {
  const Posed X_WG = turned({0.5, -1, 2}, {3, 2, 1});
  auto bone = small_grid(X_WG);
  auto scene = HapticScene{bone, 300, Floor<float>{}};
  const TickResult r = scene.tick({.X_WT = X_WG * at(0.01, 0.02, kDeep)}, kTick);
  const Vec3d expected = X_WG * Vec3d(0.01, 0.02, 0);
  CHECK((scene.proxy_pose_W().translation() - expected).norm() < 1.5e-9);
  CHECK((scene.visual_pose_W().translation() - expected).norm() < 1.5e-9);
  CHECK((scene.cutting_pose_W().translation() - expected).norm() < 1.5e-9);
  CHECK((scene.cutting_pose_W().linear() - X_WG.linear()).norm() < 5.4e-16);
  std::array<ContactPoint<double>, 4> points;
  REQUIRE(scene.contacts_W(points) == 1);
  CHECK((points[0].position - expected).norm() < 1.5e-9);
  CHECK((points[0].normal - X_WG.linear().col(2)).norm() < 1e-6);
  CHECK((points[0].force - r.wrench.force).norm() < 1e-6);
  CHECK(scene.contacts_W(std::span<ContactPoint<double>>{}) == 0);
  CHECK(scene.isovalue() == 300);
  CHECK(scene.stiffness() == 1000);
  CHECK(&scene.bone() == &bone);
}

TEST_CASE("construction refuses what cannot work, and says what to do") {
  auto bone = small_grid();
  CHECK(refusal([&] { HapticScene(bone, kNaN, Floor<>{}); }) ==
        "trephine::HapticScene: isovalue must be finite, got nan");
  CHECK(!refusal([&] { HapticScene(bone, kInf, Floor<>{}); }).empty());
}

TEST_CASE("warnings: a scene says that its isovalue finds no surface") {
  const std::vector<std::int16_t> voxels{0, 0, 0, 0, 0, 0, 0, 900};
  VoxelGrid<std::int16_t> bone({.size = {2, 2, 2}, .spacing = Vec3d::Constant(1e-2), .outside = -1000}, voxels);
  const auto said = [&](double isovalue) { return HapticScene{bone, isovalue, Floor<>{}}.warnings(); };
  CHECK(said(900).size() == 0);
  for (const double isovalue : {901.0, -1000.0}) {
    const auto warnings = said(isovalue);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("trephine::HapticScene: the isovalue") == 0);
  }
}

TEST_CASE("warnings: a scene that cuts says that voxels are too long for its tool's diameter") {
  VoxelGrid<float> bone({.size = {16, 16, 16}, .spacing = {5e-4, 5e-4, 1e-3}}, std::vector<float>(4096, 0.0F));
  const auto warned = [&](double radius, auto... parts) {
    const Burr burr{.tip_radius = radius, .shaft_radius = radius / 2};
    const auto warnings = HapticScene{bone, 0.5, Floor<>{.burr = burr}, parts...}.warnings();
    int count = 0;
    for (const std::string& w : warnings) {
      CHECK(w.find("trephine::HapticScene: ") == 0);
      if (w.find("`resampled`") == std::string::npos) continue;
      CHECK(w.find("the tool's diameter is 3.8 of the longest voxels: below 4 ") != std::string::npos);
      ++count;
    }
    return count;
  };
  CHECK(warned(1.9e-3, Witness{}) == 1);
  CHECK(warned(2.1e-3, Witness{}) == 0);
  CHECK(warned(1.9e-3) == 0);  // cuts nothing
}

TEST_CASE("a tick takes no memory, good, bad or overflowing") {
  auto bone = small_grid();
  auto scene = full_scene(bone);
  std::array<ContactPoint<double>, 4> points;
  const auto calls = heap_calls([&] {
    for (int k = 0; k < 1000; ++k) (void)scene.tick(on_path(k), kTick);
    (void)scene.tick({.X_WT = at(kNaN, 0, 0)}, kTick);
    scene.renderer().overflow = kInf;
    (void)scene.tick({.X_WT = at(0, 0, kDeep)}, kTick);
    (void)scene.contacts_W(points);
    (void)scene.proxy_pose_W();
    scene.reset();
  });
  CHECK(calls == 0);
}

TEST_CASE("a held spring and its limits make no more energy than sampling does") {
  // Rule: E <= K (T/2) ∫ v² dt for a spring held for a tick (evaluation of a sine in sustained contact).
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, DeviceLimits{.force = 100, .torque = 100}};
  double energy = 0;
  double bound = 0;
  double z = -3e-3;
  Wrenchd held = scene.tick({.X_WT = at(0, 0, z)}, kTick).wrench;
  for (int k = 1; k <= 1000; ++k) {
    const double next = -3e-3 + 1e-3 * std::sin(2 * std::numbers::pi * 5e-3 * k);
    energy += held.force.z() * (next - z);
    bound += 1000 * (kTick / 2) * (next - z) * (next - z) / kTick;
    z = next;
    held = scene.tick({.X_WT = at(0, 0, z)}, kTick).wrench;
  }
  CHECK(energy > 0);
  CHECK(energy <= bound * (1 + 1e-9));
  CHECK(energy >= bound * 0.99);
}
