// SPDX-License-Identifier: MIT
// The push out of structures' margins: an exact derivative of one potential, bounded, without steps, passive.
#include "structure/phantom.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/structure/structure_guard.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

const Burr kBurr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 12_mm};
constexpr double kReach = 5e-3;

/// Two tubes that cross at a distance, a ball that touches one of them, and a fork of one label.
LabelledTubes nerves() {
  const auto mm = [](double x, double y, double z) { return Vec3d(x * 1_mm, y * 1_mm, z * 1_mm); };
  return {.tubes = {{mm(3, 9, 9), mm(16, 9, 9), 0.8_mm},
                    {mm(9, 3, 12.5), mm(9, 16, 12.5), 0.6_mm},
                    {mm(4.5, 12, 9), mm(4.5, 12, 9), 1.4_mm},
                    {mm(4, 5, 5), mm(15, 3.5, 5), 0.7_mm},
                    {mm(4, 5, 5), mm(15, 6.5, 5), 0.7_mm}},
          .structure = {0, 1, 2, 3, 3}};
}

std::vector<GuardedStructure> options() {
  return {{.margin = 1.0_mm, .stiffness = 1000, .greatest_force = 2, .damping = 2},
          {.margin = 0.5_mm, .stiffness = 1500, .greatest_force = 1.5, .damping = 3},
          {.margin = 1.5_mm, .stiffness = 600, .greatest_force = 2, .damping = 1},
          {.margin = 0.8_mm, .stiffness = 1200, .greatest_force = 1.5, .damping = 2}};
}

const std::shared_ptr<const GuardPotential>& potential() {
  static const auto made =
      std::make_shared<const GuardPotential>(nerves().field(kReach), Posed::Identity(), kBurr, options());
  return made;
}

struct Found {
  double energy;
  Wrenchd push;
};

/// Energy and push of a guard at full share, without motion.
Found at(const GuardPotential& p, const Posed& X_ST) {
  std::vector<GuardPotential::Push> pushes(p.most_pushes());
  std::vector<GuardPotential::Load> loads(p.structures().size());
  std::vector<AxisProbe> probes(p.most_probes());
  const std::span<const GuardPotential::Push> found(pushes.data(), p.find(X_ST, pushes, probes).pushes);
  Found out{p.energy(found, loads), Wrenchd::zero()};
  for (const auto& q : found) {
    const Vec3d f = loads[static_cast<std::size_t>(q.structure)].per_u3 * q.powered() / q.depth * q.gradient;
    out.push += Wrenchd{f, (q.z * X_ST.linear().col(2)).cross(f)};
  }
  return out;
}

/// A pose near the structures: within the margin of one for most.
Posed near_pose(Random& random) {
  const LabelledTubes tubes = nerves();
  const Tube& tube = tubes.tubes[static_cast<std::size_t>(random.below(static_cast<int>(tubes.tubes.size())))];
  const Vec3d on = tube.from + random.uniform() * (tube.to - tube.from);
  const double out = tube.radius + random.uniform(0, 3.0_mm);
  const Vec3d p = on + out * random.unit();
  return make_pose<double>(random.rotation(), p);
}

TickContext context_at(const TickInput& input) {
  static const Posed kInWorld = Posed::Identity();
  TickContext c{input, kInWorld};
  c.dt = 1e-3;
  return c;
}

}  // namespace

TEST_CASE("the push is the derivative of the energy, in place and direction") {
  Random random(11);
  double worst = 0;
  int pushed = 0;
  for (int n = 0; n < 400; ++n) {
    const Posed X = near_pose(random);
    const Found here = at(*potential(), X);
    if (!(here.energy > 1e-6)) continue;
    ++pushed;
    const double step = 1e-7;
    for (int a = 0; a < 3; ++a) {
      Posed more = X, less = X;
      more.translation()[a] += step;
      less.translation()[a] -= step;
      const double f = -(at(*potential(), more).energy - at(*potential(), less).energy) / (2 * step);
      worst = std::max(worst, std::abs(f - here.push.force[a]));
      const Mat3d turn = rotation_from_vector<double>(Vec3d(1e-5 * Vec3d::Unit(a)));
      more = make_pose<double>(turn * X.linear(), X.translation());
      less = make_pose<double>(turn.transpose() * X.linear(), X.translation());
      const double t = -(at(*potential(), more).energy - at(*potential(), less).energy) / 2e-5;
      worst = std::max(worst, 100 * std::abs(t - here.push.torque[a]));  // 1 mN·m counts as .1 N
    }
  }
  CHECK(pushed > 150);
  MESSAGE("pushes off the energy's derivative by at most " << worst << " N");
  CHECK(worst < 9.9e-7);
}

TEST_CASE("closed paths do no work") {
  Random random(12);
  std::vector<double> shares;
  for (int n = 0; n < 60; ++n) {
    const Posed middle = near_pose(random);
    // A closed curve of three harmonics, in place and direction.
    std::array<Vec3d, 6> shift, turn;
    for (std::size_t h = 0; h < 6; ++h) {
      shift[h] = random.arrow(0.3, 1.0) * 1e-3;
      turn[h] = random.arrow(0.05, 0.2);
    }
    const auto pose = [&](double s) {
      Vec3d p = middle.translation(), r = Vec3d::Zero();
      for (std::size_t h = 0; h < 3; ++h) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(h + 1) * s;
        p += std::cos(angle) * shift[h] + std::sin(angle) * shift[h + 3];
        r += std::cos(angle) * turn[h] + std::sin(angle) * turn[h + 3];
      }
      return make_pose<double>(rotation_from_vector<double>(r) * middle.linear(), p);
    };
    const int steps = 4000;
    double net = 0, exchanged = 0;
    Posed last = pose(0);
    for (int i = 1; i <= steps; ++i) {
      const Posed next = pose(static_cast<double>(i % steps) / steps);
      const Vec3d half_turn = turn_between(last, next) / 2;
      const Posed mid = make_pose<double>(rotation_from_vector<double>(half_turn) * last.linear(),
                                          Vec3d(0.5 * (last.translation() + next.translation())));
      const Wrenchd w = at(*potential(), mid).push;
      const double work = w.force.dot(next.translation() - last.translation()) + w.torque.dot(2 * half_turn);
      net += work;
      exchanged += std::abs(work);
      last = next;
    }
    if (exchanged > 1e-4) shares.push_back(std::abs(net) / exchanged);
  }
  REQUIRE(shares.size() > 30);
  double mean = 0;
  for (const double s : shares) mean += s / static_cast<double>(shares.size());
  const double worst = *std::max_element(shares.begin(), shares.end());
  MESSAGE("net work of " << shares.size() << " closed paths over the work exchanged: mean " << 100 * mean
                         << " %, worst " << 100 * worst << " %");
  documented("labels", "Guard's net work on closed paths, worst", 100 * worst);
  CHECK(mean < 8.2e-7);
  CHECK(worst < 3.4e-6);
}

TEST_CASE("no step along any path, also where structures and branches meet") {
  Random random(13);
  const double dx = 10e-6;
  double worst = 0, most = 0;
  for (int n = 0; n < 400; ++n) {
    Posed X = near_pose(random);
    // Most paths run between two parts: from one tube's surroundings toward another's.
    const Vec3d way = (near_pose(random).translation() - X.translation()).normalized();
    Vec3d last = at(*potential(), X).push.force;
    for (int i = 0; i < 400; ++i) {
      X.translation() += dx * way;
      const Vec3d f = at(*potential(), X).push.force;
      worst = std::max(worst, (f - last).norm());
      most = std::max(most, f.norm());
      last = f;
    }
  }
  MESSAGE("greatest step in " << 1e6 * dx << " um: " << worst << " N, of pushes up to " << most << " N");
  documented("labels", "Greatest step of the push in 10 µm", worst);
  CHECK(most > 1.5);
  CHECK(worst < 0.05 + potential()->stiffness() * dx);
}

TEST_CASE("a structure's push is at most 1.19 times its greatest force, and points out of it") {
  Random random(14);
  const LabelledTubes tubes = nerves();
  int pushed = 0;
  for (int only = 0; only < 4; ++only) {
    auto some = options();
    for (int i = 0; i < 4; ++i)
      if (i != only) some[static_cast<std::size_t>(i)].mode = GuardMode::kOff;
    const GuardPotential one(potential()->field().structures() == 4 ? nerves().field(kReach) : nullptr,
                             Posed::Identity(), kBurr, some);
    for (int n = 0; n < 600; ++n) {
      const Posed X = near_pose(random);
      const Found found = at(one, X);
      CHECK(found.push.force.norm() <= 1.19 * some[static_cast<std::size_t>(only)].greatest_force);
      const double d = tubes.distance(only, X.translation()) - kBurr.tip_radius;
      const double margin = some[static_cast<std::size_t>(only)].margin;
      if (only != 3 && d < margin - 0.3_mm && d > 0) {  // within the fork its branches push against each other
        ++pushed;
        CHECK(found.push.force.norm() > 0.1);
      }
    }
  }
  CHECK(pushed > 100);
}

TEST_CASE("far from all margins there is nothing") {
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(9_mm, 9_mm, 40_mm));
  StructureGuard guard(potential());
  const TickInput input{.X_WT = X};
  Wrenchd w = Wrenchd::zero();
  guard.apply(context_at(input), w);
  CHECK(w == Wrenchd::zero());
  CHECK(guard.report().structure == -1);
  CHECK(guard.report().share == 1);
}

TEST_CASE("a tool within a margin is reported with its distance, also where nothing pushes") {
  Random random(20);
  auto some = options();
  some[0].mode = GuardMode::kWarn;
  some[1].mode = GuardMode::kOff;
  const LabelledTubes truth = nerves();
  StructureGuard guard(std::make_shared<const GuardPotential>(truth.field(kReach), Posed::Identity(), kBurr, some));
  int warned = 0;
  for (int n = 0; n < 300; ++n) {
    const Posed X = near_pose(random);
    const TickInput input{.X_WT = X};
    Wrenchd w = Wrenchd::zero();
    guard.apply(context_at(input), w);
    // The tool is a ball and a rod; the least distance over points of its axis, less its radius there.
    double nearest = 1;
    int of = -1;
    for (int s = 0; s < 4; ++s)
      for (double z = 0; z <= kBurr.shaft_length; z += 0.05_mm) {
        const double radius = z > 0 ? kBurr.shaft_radius : kBurr.tip_radius;
        const double d = truth.distance(s, X.translation() + z * X.linear().col(2)) - radius;
        if (d < nearest) {
          nearest = d;
          of = s;
        }
      }
    const GuardReport& r = guard.report();
    // Within two tubes at once the least of their distances is not the structure's.
    if (nearest > 0) CHECK(std::abs(r.nearest.distance - nearest) < 0.5 * truth.voxel);
    const auto s = static_cast<std::size_t>(r.nearest.structure);
    if (std::abs(nearest - some[s].margin) < 0.5 * truth.voxel || r.nearest.structure != of) continue;
    CHECK(r.warns == (s != 1 && nearest < some[s].margin));
    warned += r.warns ? 1 : 0;
  }
  CHECK(warned > 50);
}

TEST_CASE("breaches count each way into a guarded structure once, however the tool rests on its surface") {
  auto some = options();
  some[1].mode = GuardMode::kOff;
  some[2].mode = GuardMode::kWarn;
  const Burr ball{.tip_radius = 1_mm, .shaft_radius = 0.5_mm, .shaft_length = 0};
  StructureGuard guard(std::make_shared<const GuardPotential>(nerves().field(kReach), Posed::Identity(), ball, some));
  const auto go = [&](double x, double y, double z) {
    const TickInput input{.X_WT = make_pose<double>(Mat3d::Identity(), 1e-3 * Vec3d(x, y, z))};
    Wrenchd w = Wrenchd::zero();
    guard.apply(context_at(input), w);
    return guard.report().nearest.distance;
  };
  // The first tube lies along x at y = z = 9 mm, and is 0.8 mm thick: the ball touches it from 1.8 mm on.
  for (int n = 0; n < 3; ++n) {
    CHECK(go(12, 9, 6) > 1e-3);
    for (int i = 0; i < 50; ++i) CHECK(std::abs(go(12, 9, 7.2 + 0.02 * (i % 2))) < 5.1e-5);  // to and fro
    CHECK(go(12, 9, 8) < -0.5e-3);
  }
  CHECK(guard.breaches(0) == 3);
  CHECK(go(9, 5, 12.5) < -1e-3);  // within the second, which is off
  CHECK(guard.breaches(1) == 0);
  CHECK(go(9, 9, 6) > 1e-3);
  // Between the first and the third: the nearest changes to and fro, but the tool leaves neither.
  for (int i = 0; i < 20; ++i) CHECK(go(4.5, i % 2 == 0 ? 9.8 : 10.9, 9) < 0);
  CHECK(guard.breaches(0) == 4);
  CHECK(guard.breaches(2) == 1);
  CHECK(guard.breaches(3) == 0);
  CHECK(guard.breaches(4) == 0);
  CHECK(guard.breaches(-1) == 0);
  guard.reset();  // forgets contact, not what was counted
  CHECK(guard.breaches(0) == 4);
  guard.reset_counts();
  CHECK(guard.breaches(0) == 0);
}

TEST_CASE("the push fades in after a start, a switch and a jump, and out when switched off") {
  Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(9_mm, 9_mm, 9_mm));
  X.linear().col(1) *= -1;
  X.linear().col(2) *= -1;                       // the shaft points away
  X.translation() = Vec3d(12_mm, 9_mm, 6.8_mm);  // in the margin of the first tube
  const TickInput input{.X_WT = X};
  StructureGuard guard(potential(), {.ramp_time = 0.1});
  const double full = at(*potential(), X).push.force.norm();
  REQUIRE(full > 0.3);
  const auto tick = [&](Status status = Status::kOk) {
    TickContext c = context_at(input);
    c.status = status;
    Wrenchd w = Wrenchd::zero();
    guard.apply(c, w);
    return w.force.norm();
  };
  const auto run = [&](int ticks) {
    double last = 0;
    for (int i = 0; i < ticks; ++i) last = tick();
    return last;
  };
  CHECK(tick() == near(0.01 * full));
  CHECK(run(99) == near(full));
  CHECK(run(50) == near(full));
  guard.adopt({.push = false, .ramp_time = 0.1});
  CHECK(tick() == near(0.99 * full));
  CHECK(run(99) < 1e-12);
  CHECK(guard.report().depth > 0);  // it still reports
  guard.adopt({.push = true, .ramp_time = 0.1});
  CHECK(tick() == near(0.01 * full));
  CHECK(run(120) == near(full));
  CHECK(tick(Status::kJump) == near(0.01 * full));
  CHECK(run(120) == near(full));
  guard.reset();
  CHECK(tick() == near(0.01 * full));
}

TEST_CASE("damping takes energy, and no push ever pulls") {
  Random random(15);
  StructureGuard guard(potential());
  double most = 0;
  int pushed = 0;
  for (int n = 0; n < 600; ++n) {
    const Posed X = near_pose(random);
    const TickInput input{.X_WT = X};
    TickContext c = context_at(input);
    Wrenchd still = Wrenchd::zero();
    c.dt = 1;  // past the ramp
    guard.apply(c, still);
    if (still == Wrenchd::zero()) continue;
    ++pushed;
    c.twist = c.twist_to_bone = {random.arrow(0, 0.5), random.arrow(0, 10)};
    Wrenchd moving = Wrenchd::zero();
    guard.apply(c, moving);
    const double power =
        (moving.force - still.force).dot(c.twist.linear) + (moving.torque - still.torque).dot(c.twist.angular);
    CHECK(power <= 1e-12);
    most = std::min(most, power);
  }
  CHECK(pushed > 200);
  CHECK(most < -1e-3);
}

TEST_CASE("a ball that leaves a structure at any speed is never pulled back") {
  Random random(19);
  auto some = options();
  for (std::size_t i = 1; i < some.size(); ++i) some[i].mode = GuardMode::kWarn;
  const Burr ball{.tip_radius = 1.5_mm, .shaft_radius = 0, .shaft_length = 0};
  StructureGuard guard(std::make_shared<const GuardPotential>(nerves().field(kReach), Posed::Identity(), ball, some));
  int pushed = 0;
  for (int n = 0; n < 1000; ++n) {
    const TickInput input{.X_WT = near_pose(random)};
    TickContext c = context_at(input);
    c.dt = 1;
    Wrenchd still = Wrenchd::zero(), leaving = Wrenchd::zero();
    guard.apply(c, still);
    if (still == Wrenchd::zero()) continue;
    ++pushed;
    c.twist = c.twist_to_bone = {random.uniform(0, 5) * still.force.normalized(), Vec3d::Zero()};
    guard.apply(c, leaving);
    CHECK(leaving.force.dot(still.force) >= 0);
    CHECK(leaving.force.norm() <= still.force.norm() + 1e-12);
  }
  CHECK(pushed > 100);
}

TEST_CASE("a budget bounds the stiffness of the push") {
  Random random(16);
  const StiffnessBudget budget{.linear = 500, .angular = 0.05};
  const GuardPotential soft(nerves().field(kReach), Posed::Identity(), kBurr, options(), {.budget = budget});
  CHECK(soft.stiffness() <= budget.linear * (1 + 1e-9));
  CHECK(potential()->stiffness() > 1000);
  double linear = 0, angular = 0, unbound = 0;
  for (int n = 0; n < 1500; ++n) {
    const Posed X = near_pose(random);
    const Vec3d d = random.unit();
    const double step = 2e-6;
    Posed more = X;
    more.translation() += step * d;
    const double k = -(at(soft, more).push.force - at(soft, X).push.force).dot(d) / step;
    linear = std::max(linear, k);
    unbound = std::max(unbound, -(at(*potential(), more).push.force - at(*potential(), X).push.force).dot(d) / step);
    const Posed turned = make_pose<double>(rotation_from_vector<double>(Vec3d(1e-4 * d)) * X.linear(), X.translation());
    angular = std::max(angular, -(at(soft, turned).push.torque - at(soft, X).push.torque).dot(d) / 1e-4);
  }
  MESSAGE("stiffest: " << linear << " N/m of " << budget.linear << ", " << angular << " N m/rad of " << budget.angular
                       << "; without a budget " << unbound << " N/m, bound " << potential()->stiffness());
  CHECK(linear <= budget.linear);
  CHECK(angular <= budget.angular);
  CHECK(unbound <= potential()->stiffness());
}

TEST_CASE("bone that lies askew turns the push with it") {
  Random random(17);
  const Posed X_GS = make_pose<double>(random.rotation(), random.arrow(0, 0.02));
  const Posed X_WG = make_pose<double>(random.rotation(), random.arrow(0, 0.3));
  const auto askew = std::make_shared<const GuardPotential>(nerves().field(kReach), X_GS, kBurr, options());
  StructureGuard guard(askew);
  for (int n = 0; n < 50; ++n) {
    const Posed X_ST = near_pose(random);
    const TickInput input{.X_WT = X_WG * X_GS * X_ST};
    TickContext c{input, X_WG};
    c.dt = 1;
    Wrenchd w = Wrenchd::zero();
    guard.apply(c, w);
    const Wrenchd expected = at(*potential(), X_ST).push.rotated(X_WG.linear() * X_GS.linear());
    CHECK((w.force - expected.force).norm() < 1.2e-13);
    CHECK((w.torque - expected.torque).norm() < 8.9e-16);
  }
}

TEST_CASE("a tick with a guard uses no heap") {
  Random random(18);
  StructureGuard guard(potential());
  std::vector<Posed> poses;
  for (int n = 0; n < 100; ++n) poses.push_back(near_pose(random));
  CHECK(heap_calls([&] {
          for (const Posed& X : poses) {
            const TickInput input{.X_WT = X};
            Wrenchd w = Wrenchd::zero();
            guard.apply(context_at(input), w);
          }
        }) == 0);
}

TEST_CASE("what a guard cannot use is refused") {
  const auto field = nerves().field(2_mm);
  CHECK_THROWS_AS(GuardPotential(nullptr, Posed::Identity(), kBurr, options()), std::invalid_argument);
  CHECK_THROWS_AS(GuardPotential(field, Posed::Identity(), kBurr, options()), std::invalid_argument);  // reach
  const auto wide = nerves().field(kReach);
  const std::vector<GuardedStructure> few(3);
  CHECK_THROWS_AS(GuardPotential(wide, Posed::Identity(), kBurr, few), std::invalid_argument);
  for (const auto& bad :
       {GuardedStructure{.margin = -1e-3}, GuardedStructure{.margin = 1.0}, GuardedStructure{.stiffness = 0},
        GuardedStructure{.greatest_force = 0}, GuardedStructure{.damping = -1}}) {
    auto some = options();
    some[1] = bad;
    CHECK_THROWS_AS(GuardPotential(wide, Posed::Identity(), kBurr, some), std::invalid_argument);
  }
  CHECK_THROWS_AS(GuardPotential(wide, Posed::Identity(), kBurr, options(), {.smoothing = 1.0}), std::invalid_argument);
  Posed stretched = Posed::Identity();
  stretched.linear() *= 2;
  CHECK_THROWS_AS(GuardPotential(wide, stretched, kBurr, options()), std::invalid_argument);
  CHECK_THROWS_AS(StructureGuard(nullptr), std::invalid_argument);
  CHECK_THROWS_AS(StructureGuard(potential(), {.ramp_time = 0}), std::invalid_argument);
}
