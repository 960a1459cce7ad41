// SPDX-License-Identifier: MIT
// The cutting force in whole scenes: a tool fed into bone, against closed forms.
#include "stage/cutting_runs.hpp"
#include "support/cases.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::cutting;

constexpr unsigned kSeed = 2611;

TEST_CASE("cutting force: a plunging tool feels the law's thrust and torque at any voxel, tick, type and place" *
          doctest::test_suite("long")) {
  CAPTURE(kSeed);
  Random random(kSeed);
  Figures thrust, torque, work, pull;
  const auto check = [&]<class Density>(const BoneBlock<Density>& block, double dt, const char* name) {
    const Vec3d up = random.unit(), offset = random.arrow(0, block.h);
    const Plunged off = plunge(block, dt, name, up, offset);
    const std::string what = name;
    CAPTURE(what);
    CAPTURE(block.h);
    CAPTURE(dt);
    CHECK(off.fed.status == Status::kOk);
    thrust.add(off.thrust);
    torque.add(off.torque);
    work.add(off.work);
    pull.add(off.pull);
    // A hole is larger than the head where the head wanders, at voxels of .5 mm by 1 to 2 % of area.
    const bool coarse = block.h > 4e-4;
    CHECK(off.thrust < (coarse ? 0.019 : 0.015));
    CHECK(off.torque < 0.016);
    // Nothing pulls a tool sideways that cuts all round, but for the hole's wall, whose voxels press it to one side.
    CHECK(off.pull < (coarse ? 0.038 : 0.015));
  };
  for (const char* const name : {"twist-3.2", "round-3", "match-head-3", "cylinder-3"})
    for (const double h : {2e-4, 3e-4, 5e-4})
      if (!kSanitized || h == 5e-4) check(BoneBlock<std::int16_t>{.h = h, .sigma = 0.5}, 1e-3, name);
  if (!kSanitized) {
    check(BoneBlock<std::int16_t>{.sigma = 1}, 0.25e-3, "cylinder-3");
    check(BoneBlock<std::int16_t>{}, 0.25e-3, "twist-3.2");
    check(BoneBlock<std::int16_t>{}, 4e-3, "twist-3.2");
    check(BoneBlock<std::int16_t>{}, 4e-3, "match-head-3");
    check(BoneBlock<std::uint8_t>{}, 1e-3, "twist-3.2");
    check(BoneBlock<std::uint8_t>{}, 1e-3, "round-3");
    check(BoneBlock<float>{}, 1e-3, "match-head-3");
  }
  MESSAGE("off the law by: thrust ", thrust, "; torque ", torque, "; work of chips ", work,
          "; pull sideways over thrust ", pull);
  if (kSanitized) return;
  documented("cutting_runs", "Thrust of a plunge", thrust, 100);
  documented("cutting_runs", "Torque of a plunge", torque, 100);
  documented("cutting_runs", "Work on chips against u by volume", work, 100);
  documented("cutting_runs", "Pull sideways of a plunge, by thrust", pull, 100);
  CHECK(thrust.median() < 0.0053);
  CHECK(torque.median() < 0.0092);
  CHECK(work.worst() < 0.012);
}

// A `Burr` cuts by a sweep of its own.
TEST_CASE("cutting force: a plain burr feels the law's thrust and torque of its own ball") {
  Random random(kSeed + 5);
  const Burr burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.04};
  HeadElements::Numbers one;
  one.fill(1);
  const Engagement whole_ball = engagement_of(HeadElements(outline_of(burr)), -Vec3d::UnitZ(), one, one);
  Figures thrust, torque;
  for (const double h : {3e-4, 5e-4}) {
    if (kSanitized && h < 5e-4) continue;
    const BoneBlock<std::int16_t> block{.h = h};
    const Vec3d up = random.unit(), top = block.middle() + 0.2 * block.length * up + random.arrow(0, h);
    VoxelGrid<std::int16_t> bone = block.image(HalfSpace{top, up});
    CuttingForce::Options o{.force_scale = 0.25};
    o.strength = block.strength();
    HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{burr, CoupledOptions{.stiffness = 2000}},
                      Cutting{PressureCut{}, CuttingForce(o)}};
    const Mat3d R = tool_at(Vec3d::Zero(), up).linear();
    const double speed = 1e-3, x = speed / o.speed;
    double mean_thrust = 0, mean_torque = 0;
    int count = 0;
    for (double z = 1.6e-3; z > -2.5e-3; z -= speed * 1e-3) {
      const TickResult r = scene.tick({.X_WT = make_pose<double>(R, top + z * up), .spindle_on = true}, 1e-3);
      CHECK(r.status == Status::kOk);
      if (z > -1.7e-3) continue;
      mean_thrust += scene.cutting().law().report().thrust;
      mean_torque += scene.cutting().law().report().torque;
      ++count;
    }
    thrust.add(std::abs(mean_thrust / count / o.law.thrust(x, whole_ball, o.edges, burr.tip_radius) - 1));
    torque.add(std::abs(mean_torque / count / o.law.torque(x, whole_ball, o.edges) - 1));
  }
  MESSAGE("off the law by: thrust ", thrust, "; torque ", torque);
  CHECK(thrust.worst() < 0.02);
  CHECK(torque.worst() < 0.02);
}

// A drill's wall is made by an edge that passes. If voxels behind the edge kept bone, the drill would be held by it.
TEST_CASE("cutting force: a drill's hole is as wide as the drill" * doctest::test_suite("long")) {
  Random random(kSeed + 4);
  Figures off;
  for (const char* const name : {"twist-2", "twist-3.2"})
    for (const double h : {2e-4, 3e-4, 5e-4})
      for (int n = 0; n < (kSanitized ? 1 : 2); ++n) {
        if (kSanitized && h < 5e-4) continue;
        const std::string what = name;
        CAPTURE(what);
        CAPTURE(h);
        const BoneBlock<std::int16_t> block{.h = h};
        const NamedTool tool = tool_by_name(name);
        const double R = tool.tool.burr().tip_radius;
        const Vec3d up = random.unit(), top = block.middle() + 0.2 * block.length * up + random.arrow(0, h);
        const Mat3d R_GT = tool_at(Vec3d::Zero(), up).linear();
        VoxelGrid<std::int16_t> bone = block.image(HalfSpace{top, up});
        auto o = drill_options();
        o.edges = tool.edges;
        o.strength = block.strength();
        HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                          Cutting{PressureCut{}, CuttingForce(o)}};
        // Its axis as its edge passes the wall that is measured: 2 to 2.8 mm deep, the edge within a millimetre of T.
        Vec3d axis = Vec3d::Zero();
        int count = 0;
        for (double z = R + 1e-4; z > R - 5e-3; z -= 2e-6) {
          const TickResult r = scene.tick({.X_WT = make_pose<double>(R_GT, top + z * up), .spindle_on = true}, 1e-3);
          CHECK(r.status == Status::kOk);
          if (z > -1.5e-3) continue;
          axis += scene.renderer().proxy_pose().translation() - (top + z * up);
          ++count;
        }
        axis /= count;
        const DensityField<std::int16_t, double> field(bone, block.isovalue());
        double mean = 0, square = 0;
        constexpr int kRays = 400;
        for (int i = 0; i < kRays; ++i) {
          const double angle = random.uniform(0, 2 * std::numbers::pi);
          const Vec3d out = R_GT * Vec3d(std::cos(angle), std::sin(angle), 0);
          const Vec3d from = top + axis - random.uniform(2e-3, 2.8e-3) * up;
          double low = R - h, high = R + h;
          for (int step = 0; step < 30; ++step) {
            const double rho = (low + high) / 2;
            (field.value(from + rho * out) < 0 ? low : high) = rho;
          }
          mean += (low - R) / h / kRays;
          square += std::pow((low - R) / h, 2) / kRays;
        }
        off.add(std::abs(mean));
        CHECK(std::abs(mean) < 0.029);
        CHECK(std::sqrt(square) < 0.059);
      }
  MESSAGE("mean radius of a drill's hole off the drill's [voxels]: ", off);
}

TEST_CASE("cutting force: feed, speed, size, density and edges act as they should" * doctest::test_suite("long")) {
  const BoneBlock<std::int16_t> block{};
  const Vec3d up = Vec3d{0.3, -0.2, 1}.normalized(), offset{1e-4, 2e-5, -7e-5};
  const auto run = [&](const char* name, CuttingForce::Options o, double speed, const BoneBlock<std::int16_t>& in) {
    return feed(in, tool_by_name(name), o, {.speed = speed, .deep = 0.0055}, up, offset);
  };
  const auto drill = drill_options();
  const Fed base = run("twist-3.2", drill, 2e-3, block);
  // Twice the feed: more thrust and torque, less than twice (edges). Twice the turns: less of both.
  const Fed fast = run("twist-3.2", drill, 4e-3, block);
  CHECK(fast.torque > 1.3 * base.torque);
  CHECK(fast.torque < 2 * base.torque);
  CHECK(fast.thrust > 1.1 * base.thrust);
  CHECK(fast.thrust < 2 * base.thrust);
  auto quick = drill;
  quick.speed *= 2;
  const Fed turned = run("twist-3.2", quick, 2e-3, block);
  CHECK(turned.torque < 0.8 * base.torque);
  CHECK(turned.torque > 0.5 * base.torque);
  CHECK(turned.thrust < 0.95 * base.thrust);
  // The same chip: twice the feed and twice the turns.
  const Fed same_chip = run("twist-3.2", quick, 4e-3, block);
  CHECK(std::abs(same_chip.torque / base.torque - 1) < 8e-5);
  CHECK(std::abs(same_chip.thrust / base.thrust - 1) < 8.2e-5);
  // A larger drill: torque by about the square of its radius.
  const Fed large = run("twist-4.5", drill, 2e-3, block);
  const double exponent = std::log(large.torque / base.torque) / std::log(4.5 / 3.2);
  CHECK(exponent > 1.8);
  CHECK(exponent < 2.3);
  // A quarter of the strength, felt four times as much.
  CuttingForce::Options soft = drill;
  soft.force_scale = 0.04;
  soft.law.energy /= 4;
  soft.law.edge_force /= 4;
  soft.law.edge_thrust /= 4;
  soft.law.chisel /= 4;
  const Fed quarter = run("twist-3.2", soft, 2e-3, block);
  CHECK(std::abs(4 * quarter.torque / base.torque - 1) < 1e-12);
  CHECK(std::abs(4 * quarter.thrust / base.thrust - 1) < 1e-12);
}

TEST_CASE("cutting force: density acts by the strength of bone") {
  BoneBlock<std::int16_t> half{};
  half.contrast = 1350;
  half.air = 0;
  const Vec3d up = Vec3d::UnitZ();
  const auto measure = [&](double cortical) {
    const NamedTool tool = tool_by_name("twist-3.2");
    const Vec3d top = half.middle() + 0.2 * half.length * up;
    VoxelGrid<std::int16_t> bone = half.image(HalfSpace{top, up});
    auto o = drill_options();
    o.edges = tool.edges;
    o.strength = {.soft = 0, .cortical = cortical};
    o.force_scale = 0.02;
    HapticScene scene{bone, half.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                      Cutting{PressureCut{}, CuttingForce(o)}};
    double torque = 0;
    for (int i = 0; i < 2800; ++i) {
      const TickResult r = scene.tick({.X_WT = tool_at(top + (1.7e-3 - i * 2e-6) * up, up), .spindle_on = true}, 1e-3);
      REQUIRE(r.status == Status::kOk);
      if (i >= 2300) torque += scene.cutting().law().report().torque / 500;
    }
    return torque;
  };
  CHECK(std::abs(4 * measure(2700) / measure(1350) - 1) < 0.023);
}

TEST_CASE("cutting force: a slot takes the power of its volume, and the teeth pull the tool sideways" *
          doctest::test_suite("long")) {
  const double speed = 4e-3, R = 0.0015;
  const CuttingLaw law;
  Random random(kSeed + 3);
  Figures power, sides, along;
  for (int n = 0; n < (kSanitized ? 1 : 6); ++n) {
    const bool clockwise = n % 2 == 0;
    const double deep = random.uniform(1.2e-3, 2.6e-3);
    const Slot s = mill(clockwise, 1, speed, deep);
    CAPTURE(clockwise);
    CAPTURE(deep);
    CHECK(s.status == Status::kOk);
    const double expected = 2 * R * deep * speed * 1e9;
    CHECK(std::abs(s.rate / expected - 1) < 0.0058);
    CHECK(std::abs(s.torque * rpm(30'000) / s.power - 1) < 4e-4);
    // However deep: bone at the blurred surface counts as whole.
    power.add(std::abs(s.power / (law.energy * s.rate * 1e-9) - 1));
    CHECK(power.all().back() < 0.0031);
    // Teeth that turn clockwise, seen from the handle, move toward −y at the front, and bone pushes the tool to +y: π/4
    // of torque over R, for the side; the flat front adds to it where it cuts. A wall of 1.2 mm has two or three bands.
    sides.add((clockwise ? 1 : -1) * s.pull.y() * R / s.torque);
    CHECK(sides.all().back() > 0.55);
    CHECK(sides.all().back() < 0.95);
    along.add(std::abs(s.pull.x() * R / s.torque));
  }
  CHECK(along.worst() < 0.4);
  MESSAGE("power off u by volume ", power, "; pull over torque by radius ", sides, " (pi/4 by the law), along ", along);
}

TEST_CASE("cutting force: a burr that climbs is pulled forward, one that mills up is pushed back") {
  const double speed = 4e-3;
  // Bone on the side −y alone.
  const Slot a = mill(true, 0.5, speed), b = mill(false, 0.5, speed);
  CHECK(a.status == Status::kOk);
  CHECK(b.status == Status::kOk);
  CHECK(a.pull.x() * b.pull.x() < 0);
  CHECK(std::abs(a.pull.x()) > 0.2 * a.pull.norm());
  // Clockwise, at y < 0 teeth move to −x, and bone pushes the tool forward, to +x.
  CHECK(a.pull.x() > 0);
}

TEST_CASE("cutting force: pull and torque of a ball's lower half belong together, whichever way the bone is turned") {
  const BoneBlock<std::int16_t> block{.length = 10e-3};
  const NamedTool tool = tool_by_name("round-3");
  const Posed turned = make_pose<double>(rotation_from_vector(Vec3d(1.1, -0.7, 2)), Vec3d(0.1, -0.2, 0.3));
  std::array<Wrenchd, 2> edges{};
  Engagement on;
  for (std::size_t n = 0; n < 2; ++n) {
    const Posed X_WG = n == 0 ? Posed::Identity() : turned;
    VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
    bone.set_X_WG(X_WG);
    CuttingForce::Options o{.edges = tool.edges, .force_scale = 0.1};
    o.strength = block.strength();
    HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 1500}},
                      Cutting{PressureCut{}, CuttingForce(o)}};
    // Down to its middle, then aside.
    for (int i = 0; i < 900; ++i) {
      const Vec3d way(-1.5e-3 + std::max(0, i - 400) * 4e-6, 0, std::max(0.0, 1.5e-3 - i * 5e-6));
      static_cast<void>(
          scene.tick({.X_WT = X_WG * tool_at(block.middle() + way, Vec3d::UnitZ(), 0.7), .spindle_on = true}, 1e-3));
      if (i >= 700) edges[n] += 0.005 * scene.cutting().law().report().edges.rotated(X_WG.linear().transpose());
    }
    on = scene.cutting().law().engagement();
  }
  // Teeth pull across the axis at heights from −R to 0, and turn the tool by as much.
  const double R = tool.tool.burr().tip_radius;
  const Vec3d pull(edges[0].force.x(), edges[0].force.y(), 0);
  CHECK(pull.norm() > 1);
  const double height = edges[0].torque.dot(Vec3d::UnitZ().cross(pull)) / pull.squaredNorm();
  CHECK(height == within(-0.5 * R, 0.4 * R));
  // As the elements that cut do.
  CHECK(height == near(on.moment.dot(Vec3d::UnitZ().cross(on.around)) / on.around.squaredNorm(), 0.05));
  CHECK((edges[1].force - edges[0].force).norm() < 0.03 * edges[0].force.norm());
  CHECK((edges[1].torque - edges[0].torque).norm() < 0.03 * edges[0].torque.norm());
}

TEST_CASE("cutting force: the spindle's work on chips is u by volume, on any path and with any cut" *
          doctest::test_suite("long")) {
  Random random(kSeed + 1);
  for (int n = 0; n < cases(8); ++n) {
    const BoneBlock<std::int16_t> block{};
    const NamedTool tool = tool_by_name("match-head-3");
    VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
    const CuttingForce::Options o{.edges = tool.edges, .strength = block.strength()};
    const auto run = [&](auto&& scene) {
      double V = 0;
      const double a = random.uniform(0, 6), b = random.uniform(0, 6), tilt = random.uniform(0, 0.6);
      for (int i = 0; i < 3000; ++i) {
        const double t = i * 1e-3;
        const Vec3d at = block.middle() + Vec3d(3e-3 * std::sin(2 * t + a), 2e-3 * std::sin(3 * t + b),
                                                1.5e-3 - 1.2e-3 * t * t / 9 * (1 + 0.5 * std::sin(9 * t)));
        const Vec3d axis = Vec3d(tilt * std::sin(t), tilt * std::cos(2 * t), 1).normalized();
        V += scene.tick({.X_WT = tool_at(at, axis), .spindle_on = true}, 1e-3).removed_mm3;
      }
      // Rest in the air: the last deposit is taken out.
      for (int i = 0; i < 200; ++i)
        V += scene.tick({.X_WT = tool_at(block.middle() + Vec3d(0, 0, 5e-3), Vec3d::UnitZ()), .spindle_on = true}, 1e-3)
                 .removed_mm3;
      CHECK(V > 1);
      return scene.cutting().law().report().chip_work / (o.law.energy * V * 1e-9);
    };
    const CoupledToolRenderer renderer{tool.tool, CoupledOptions{.stiffness = 1500}};
    CHECK(run(HapticScene{bone, block.isovalue(), renderer, Cutting{PressureCut{}, CuttingForce(o)}}) == near(1, 0.02));
    bone.restore();
    CHECK(run(HapticScene{bone, block.isovalue(), renderer, Cutting{GeometricCut{}, CuttingForce(o)}}) ==
          near(1, 0.0068));
  }
}

TEST_CASE("cutting force: a spindle stalls by itself, nothing is cut then, and it recovers") {
  const BoneBlock<std::int16_t> block{};
  const NamedTool tool = tool_by_name("twist-3.2");
  const Vec3d up = Vec3d::UnitZ(), top = block.middle() + 0.2 * block.length * up;
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{top, up});
  auto o = drill_options();
  o.edges = tool.edges;
  o.strength = block.strength();
  o.stall_torque = 0.05;  // of 0.18 N m that the feed takes
  o.inertia = 1e-5;
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                    Cutting{PressureCut{}, CuttingForce(o)}};
  const auto tick = [&](double height) {
    const TickResult r = scene.tick({.X_WT = tool_at(top + height * up, up), .spindle_on = true}, 1e-3);
    CHECK(is_finite(r.wrench));
    return r;
  };
  double height = 1.7e-3;
  for (int i = 0; i < 2500; ++i) tick(height -= 2e-6);
  const CuttingReport stalled = scene.cutting().law().report();
  CHECK(stalled.spindle == 0);
  CHECK(stalled.torque <= o.stall_torque * 1.01);
  double removed = 0;
  for (int i = 0; i < 300; ++i) removed += tick(height -= 2e-6).removed_mm3;
  CHECK(removed == 0);
  for (int i = 0; i < 1500; ++i) tick(height += 5e-6);
  CHECK(scene.cutting().law().report().spindle > 0.9 * o.speed);
}

// Its margins touch the wall where no element has bone ahead: what presses that lightly must not be cut at once.
TEST_CASE("cutting force: a drill that leans as it is pulled out of its hole is not pulled aside") {
  Random random(kSeed + 6);
  Figures removed, pull;
  for (int n = 0; n < cases(6); ++n) {
    const BoneBlock<std::int16_t> block{.sigma = 0.5};
    const NamedTool tool = tool_by_name("twist-3.2");
    const Vec3d up = random.unit(), top = block.middle() + 0.2 * block.length * up + random.arrow(0, block.h);
    VoxelGrid<std::int16_t> bone = block.image(HalfSpace{top, up});
    CuttingForce::Options o = drill_options();
    o.edges = tool.edges;
    o.strength = block.strength();
    HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 800}},
                      Cutting{PressureCut{}, CuttingForce(o)}};
    const Vec3d lean = 0.05 * random.unit(), aside = 2e-4 * random.unit();
    double most = 0, volume = 0;
    const auto tick = [&](double z, double part) {
      const Vec3d axis = (up + part * lean).normalized();
      const TickResult r = scene.tick({.X_WT = tool_at(top + z * up + part * aside, axis), .spindle_on = true}, 1e-3);
      const Vec3d edges = scene.cutting().law().report().edges.force;
      most = std::max(most, (edges - axis.dot(edges) * axis).norm());
      volume += r.removed_mm3;
    };
    double z = 1.7e-3;
    while (z > -1.5e-3) tick(z -= 2e-6, 0);
    for (int i = 0; i < 100; ++i) tick(z += 4e-6, 0);
    most = volume = 0;
    for (double part = 0; z < 3e-3; part = std::min(1.0, part + 0.02)) tick(z += 4e-5, part);
    removed.add(volume);
    pull.add(most);
    // A hand that is .2 mm off presses with 16 N of true force, and its lean with as much again.
    CHECK(most < 25);
    CHECK(volume < 0.13);
  }
  MESSAGE("removed [mm3] ", removed, "; pull aside [N] ", pull);
}

TEST_CASE("cutting force: thrust drops when the far side of a tilted plate breaks" * doctest::test_suite("long")) {
  Random random(kSeed + 2);
  Figures fine, coarse;
  for (const double sigma : {0.5, 0.7, 1.0})
    for (int n = 0; n < (kSanitized ? 1 : 3); ++n) {
      const BoneBlock<std::int16_t> block{.sigma = sigma, .length = 10e-3};
      const Vec3d up = random.unit(), offset = random.arrow(0, block.h);
      coarse.add(1e3 * breakthrough(block, up, offset, 1e-3));
      if (!kSanitized) fine.add(1e3 * breakthrough(block, up, offset, 0.25e-3));
    }
  MESSAGE("thrust falls from four fifths to a fifth in [ms]: ", fine, " at 4 kHz; ", coarse, " at 1 kHz");
  if (kSanitized) return;
  documented("cutting_runs", "– 4 kHz, plate askew", fine);
  documented("cutting_runs", "– 1 kHz, plate askew", coarse);
  CHECK(fine.median() <= 2);
  CHECK(coarse.median() <= 2);
  CHECK(fine.worst() <= 4.5);
  CHECK(coarse.worst() <= 6);
}

TEST_CASE("cutting force: thrust drops when the far side of a plate along voxels breaks" *
          doctest::test_suite("long")) {
  // The last film is a plane of voxels, barely bone. Where it gives way in part, the head stands on its rim and sinks
  // through the film's voxel: a few plates in a hundred, mostly with the axis through voxels (every other one here).
  Random random(kSeed + 7);
  Figures fine, coarse;
  int late = 0, plates = 0;
  for (const double sigma : {0.5, 0.7, 1.0})
    for (int n = 0; n < (kSanitized ? 1 : 12); ++n, ++plates) {
      const BoneBlock<std::int16_t> block{.sigma = sigma, .length = 10e-3};
      const Vec3d up = Vec3d::UnitZ(), offset = n % 2 == 0 ? random.uniform(0, block.h) * up : random.arrow(0, block.h);
      const double ms = 1e3 * breakthrough(block, up, offset, 1e-3);
      coarse.add(ms);
      late += ms > 10 ? 1 : 0;
      if (!kSanitized && n < 3) fine.add(1e3 * breakthrough(block, up, offset, 0.25e-3));
    }
  MESSAGE("thrust falls from four fifths to a fifth in [ms]: ", fine, " at 4 kHz; ", coarse, " at 1 kHz; ", late,
          " of ", plates, " plates take more than 10 ms");
  documented("cutting_runs", "Fall of thrust, plate along the voxels, 4 kHz", fine);
  documented("cutting_runs", "– 1 kHz, along the voxels", coarse);
  const double through_a_voxel = 300;  // [ms], at 1 mm/s
  CHECK(coarse.worst() <= through_a_voxel);
  if (kSanitized) return;
  CHECK(fine.worst() <= through_a_voxel);
  CHECK(fine.median() <= 0.75);
  CHECK(coarse.median() <= 2);
  CHECK(late <= plates / 7);
}

TEST_CASE("cutting force: the device gets its share, the report the true forces") {
  const BoneBlock<std::int16_t> block{};
  const NamedTool tool = tool_by_name("round-3");
  const auto run = [&](double force_scale, double stiffness) {
    VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
    CuttingForce::Options o{.edges = tool.edges, .force_scale = force_scale};
    o.strength = block.strength();
    HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = stiffness}},
                      Cutting{PressureCut{}, CuttingForce(o)}};
    CuttingReport mean;  // of the last tenth
    for (int i = 0; i < 3000; ++i) {
      const TickResult r = scene.tick(
          {.X_WT = tool_at(block.middle() + Vec3d(0, 0, 1.5e-3 - i * 1e-6), Vec3d::UnitZ()), .spindle_on = true}, 1e-3);
      if (i < 2700) continue;
      const CuttingReport& now = scene.cutting().law().report();
      const Wrenchd contact = r.wrench + (-force_scale) * now.edges;
      CHECK(std::abs(contact.force.z() / (force_scale * now.thrust) - 1) < 1.4e-4);
      CHECK(std::abs(contact.torque.z()) <
            0.01 * force_scale * now.torque);  // of contact without friction there is none
      CHECK(std::abs(now.edges.torque.z() / now.torque - 1) < 1e-9);
      mean.thrust += now.thrust / 300;
      mean.torque += now.torque / 300;
    }
    return mean;
  };
  // The same true forces: a softer coupling with a smaller share.
  const CuttingReport whole = run(0.5, 1500), part = run(0.25, 750);
  CHECK(std::abs(part.thrust / whole.thrust - 1) < 0.0049);
  CHECK(std::abs(part.torque / whole.torque - 1) < 0.005);
}

TEST_CASE("cutting force: nothing without a spindle, in the air, or from a wall that only the shank touches") {
  const BoneBlock<std::int16_t> block{};
  const NamedTool tool = tool_by_name("twist-3.2");
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
  CuttingForce::Options o{.edges = tool.edges};
  o.strength = block.strength();
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{}},
                    Cutting{PressureCut{}, CuttingForce(o)}};
  const auto tick = [&](const Vec3d& from_middle, const Vec3d& axis, bool on) {
    return scene.tick({.X_WT = tool_at(block.middle() + from_middle, axis), .spindle_on = on}, 1e-3);
  };
  for (int i = 0; i < 100; ++i) {
    tick(Vec3d(0, 0, 3e-3), Vec3d::UnitZ(), true);
    const CuttingReport& air = scene.cutting().law().report();
    CHECK(air.torque == 0);
    CHECK(air.edges == Wrenchd::zero());
  }
  for (int i = 0; i < 600; ++i) CHECK(tick(Vec3d(0, 0, 2e-3 - i * 2e-6), Vec3d::UnitZ(), false).removed_mm3 == 0);
  CHECK(scene.cutting().law().report().torque == 0);
  // From the tick on in which the spindle stops, edges have no force: what chips still held is dropped.
  scene.reset();
  for (int i = 0; i < 600; ++i) tick(Vec3d(0, 0, 2e-3 - i * 2e-6), Vec3d::UnitZ(), true);
  CHECK(scene.cutting().law().report().torque > 0);
  tick(Vec3d(0, 0, 0.8e-3), Vec3d::UnitZ(), false);
  CHECK(scene.cutting().law().report().torque == 0);
  CHECK(scene.cutting().law().report().edges == Wrenchd::zero());
  // The flank lies on the plane, the head beyond its edge would be in the air: here it is lifted.
  scene.reset();
  double removed = 0;
  for (int i = 0; i < 400; ++i)
    removed += tick(Vec3d(-6e-3, 0, 3e-3 - i * 5e-6), Vec3d(1, 0, -0.08).normalized(), true).removed_mm3;
  CHECK(removed < 1e-3);
  // Nor does a shank that leans on the plane, its head in the air, press a burr's edges.
  const NamedTool burr = tool_by_name("match-head-3");
  o.edges = burr.edges;
  HapticScene leaning{bone, block.isovalue(), CoupledToolRenderer{burr.tool, CoupledOptions{}},
                      Cutting{PressureCut{}, CuttingForce(o)}};
  TickResult r;
  for (int i = 0; i < 400; ++i)
    r = leaning.tick(
        {.X_WT = tool_at(block.middle() + Vec3d(-5e-3, 0, 3.2e-3 - i * 3e-6), Vec3d(1, 0, -0.15).normalized()),
         .spindle_on = true},
        1e-3);
  CHECK(r.wrench.force.norm() > 0.1);
  CHECK(r.cutting.thrust == 0);
}

TEST_CASE("cutting force: a tissue that is cut at half the rate takes twice the thrust and torque") {
  const BoneBlock<std::int16_t> block{};
  const NamedTool tool = tool_by_name("round-3");
  const Vec3d up = Vec3d::UnitZ(), top = block.middle() + 0.2 * block.length * up;
  CuttingForce::Options o{.edges = tool.edges, .force_scale = 0.05};
  o.strength = block.strength();
  // Two layers under the surface: the upper of rate 1, the lower from 2.5 mm on of rate 1/2.
  const std::array<double, 2> rates{1, 0.5};
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{top, up});
  const double border = top.z() - 2.5e-3;
  const auto tissues =
      std::make_shared<const TissueMap>(bone, rates, [&](int, int, int k) { return k * block.h < border ? 1 : 0; });
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                    Cutting{PressureCut{}, CuttingForce(o, tissues)}};
  const double R = tool.tool.burr().tip_radius, speed = 1e-3;
  std::array<CuttingReport, 2> mean;  // while all that cuts is in one tissue
  std::array<int, 2> count{};
  for (int i = 0; i < 5600; ++i) {
    const double tip = 1e-4 - i * speed * 1e-3;
    static_cast<void>(scene.tick({.X_WT = tool_at(top + (tip + R) * up, up), .spindle_on = true}, 1e-3));
    const int layer = tip < -2.1e-3 && tip > -2.4e-3 ? 0 : tip < -5e-3 ? 1 : -1;
    if (layer < 0) continue;
    const auto l = static_cast<std::size_t>(layer);
    const CuttingReport& now = scene.cutting().law().report();
    mean[l].thrust += now.thrust;
    mean[l].torque += now.torque;
    ++count[l];
  }
  CHECK(std::abs(mean[1].thrust / count[1] / (mean[0].thrust / count[0]) / 2 - 1) < 0.0025);
  CHECK(std::abs(mean[1].torque / count[1] / (mean[0].torque / count[0]) / 2 - 1) < 0.0023);
  const VoxelGrid<std::int16_t> other = BoneBlock<std::int16_t>{.length = 10e-3}.image(HalfSpace{block.middle(), up});
  CHECK_THROWS_AS(CuttingForce(o, tissues).validate_for(other, 0), std::invalid_argument);
}

TEST_CASE("cutting force: bone without strength is cut as a geometric cut would") {
  const BoneBlock<std::int16_t> block{};
  const NamedTool tool = tool_by_name("round-3");
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
  CuttingForce::Options o{.edges = tool.edges};
  o.strength = {.soft = block.air + block.contrast, .cortical = 2 * block.contrast};
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{}},
                    Cutting{PressureCut{}, CuttingForce(o)}};
  double most = 0;
  for (int i = 0; i < 1500; ++i) {
    const TickResult r = scene.tick(
        {.X_WT = tool_at(block.middle() + Vec3d(0, 0, 1.6e-3 - i * 2e-6), Vec3d::UnitZ()), .spindle_on = true}, 1e-3);
    CHECK(r.status == Status::kOk);
    most = std::max(most, r.wrench.force.norm());
  }
  CHECK(most < 0.05);
  CHECK(scene.cutting().law().report().feed <= kMaxSpeed);
}

TEST_CASE("cutting force: protected bone stays") {
  const BoneBlock<std::int16_t> block{};
  const NamedTool tool = tool_by_name("match-head-3");
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
  const double deep = 1e-3;
  auto floor = std::make_shared<CutFloor<std::int16_t>>(bone, block.isovalue());
  const std::array<int, 3> n = bone.size();
  floor->protect(0, {{0, 0, 0}, {n[0] - 1, n[1] - 1, n[2] - 1}},
                 [&](int, int, int k) { return k * block.h - (block.middle().z() - deep); });
  floor->seal(bone);
  CuttingForce::Options o{.edges = tool.edges, .force_scale = 0.05};
  o.strength = block.strength();
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                    Cutting{PressureCut{}, CuttingForce(o)}, Veto{floor}};
  for (int i = 0; i < 3000; ++i)
    static_cast<void>(scene.tick(
        {.X_WT = tool_at(block.middle() + Vec3d(0, 0, 1.5e-3 - i * 2e-6), Vec3d::UnitZ()), .spindle_on = true}, 1e-3));
  const DensityField<std::int16_t, double> field(bone, block.isovalue());
  CHECK(field.value(block.middle() - Vec3d(0, 0, deep + 0.2e-3)) > 0);
  CHECK(field.value(block.middle() - Vec3d(0, 0, deep - 0.2e-3)) < 0);
}

TEST_CASE("cutting force: works with other renderers and cuts, and takes no memory in a tick") {
  const BoneBlock<std::int16_t> block{};
  VoxelGrid<std::int16_t> bone = block.image(HalfSpace{block.middle(), Vec3d::UnitZ()});
  CuttingForce::Options o{};
  o.strength = block.strength();
  const auto run = [&](auto scene) {
    double torque = 0;
    std::int64_t calls = 0;
    for (int i = 0; i < 1200; ++i) {
      const TickInput input{.X_WT = tool_at(block.middle() + Vec3d(0, 0, 1.6e-3 - i * 1e-6), Vec3d::UnitZ()),
                            .spindle_on = true};
      calls += heap_calls([&] { static_cast<void>(scene.tick(input, 1e-3)); });
      torque += scene.cutting().law().report().torque;
    }
    CHECK(calls == 0);
    CHECK(torque > 0);
  };
  const CuttingForce law(o);
  run(HapticScene{bone, block.isovalue(), CoupledToolRenderer{kDrill, kGains}, Cutting{PressureCut{}, law}});
  bone.restore();
  run(HapticScene{bone, block.isovalue(), CoupledToolRenderer{kDrill, kGains}, Cutting{GeometricCut{}, law}});
  bone.restore();
  run(HapticScene{bone, block.isovalue(), CoupledToolRenderer{kDrill, kGains},
                  Cutting{RateLimitedCut<>{.rate = 2e5}, law}});
  bone.restore();
  const ToolDiscretization vertices{kDrill, SurfaceCounts{}};
  run(HapticScene{bone, block.isovalue(), SurfaceApproxRenderer{vertices, SurfaceOptions{}},
                  Cutting{GeometricCut{}, law}});
}

TEST_CASE("cutting force: options out of range are refused") {
  using O = CuttingForce::Options;
  CHECK_THROWS_AS(CuttingForce(O{.speed = 0}), std::invalid_argument);
  CHECK_THROWS_AS(CuttingForce(O{.stall_torque = 0}), std::invalid_argument);
  CHECK_THROWS_AS(CuttingForce(O{.inertia = -1}), std::invalid_argument);
  CHECK_THROWS_AS(CuttingForce(O{.force_scale = 0}), std::invalid_argument);
  CHECK_THROWS_AS(CuttingForce(O{.force_scale = 1.5}), std::invalid_argument);
  CHECK_THROWS_AS(CuttingForce(O{.lag = 0}), std::invalid_argument);
  CHECK_THROWS_AS(CuttingForce(O{.edges = {.flutes = 0}}), std::invalid_argument);
}

}  // namespace
