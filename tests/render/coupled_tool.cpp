// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/path_work.hpp"

#include <trephine/device/simulated_device.hpp>
#include <trephine/render/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};
constexpr CoupledOptions kGains{.stiffness = 700, .rotational_stiffness = 0.3, .force = 3.3, .torque = 0.188};

template <class Scalar = float, class Law = Frictionless, class Motion = SixDof>
using Coupled = CoupledToolRenderer<Scalar, FromDepthMap, Law, Motion>;

/// A bone of a shape, its depths, and a coupled tool on them.
template <class Scalar = float, class Law = Frictionless, class Motion = SixDof>
struct Bench {
  RasterOptions options;
  VoxelGrid<std::uint8_t> bone;
  DepthMap map;
  Coupled<Scalar, Law, Motion> tool;

  template <class Shape>
  Bench(const Shape& shape, const RasterOptions& o, const SurfaceCounts& counts = SurfaceCounts::thesis(),
        const Burr& burr = kDrill, const CoupledOptions& gains = kGains, const Law& law = Law{})
      : options(o),
        bone(rasterise<std::uint8_t>(shape, o)),
        map(bone, o.isovalue()),
        tool(ToolDiscretization<SurfaceCounts, Scalar>(burr, counts), FromDepthMap(map), gains, law) {}

  Rendered<Scalar> at(const Posed& X) { return render_at(tool, tool.field(bone, options.isovalue()), X); }
  Rendered<Scalar> lead_to(const Posed& a, const Posed& b, int ticks) {
    return lead(tool, tool.field(bone, options.isovalue()), a, b, ticks);
  }
};

const Vec3d kTilted = Vec3d(0.3, 0.5, 0.8).normalized();
const RasterOptions kRoom{.size = {96, 96, 96}};

// --- What the hand feels
// ----------------------------------------------------------------------------------------------

// Pressed d beyond touching, a series of springs k_v and k_c: F = d k_v k_c / (k_v + k_c) along the normal, no torque.
TEST_CASE_TEMPLATE("on a plane: the coupling's stiffness, the plane's direction, no sinking", Scalar, float, double) {
  for (const int sphere : {26, 100, 300}) {
    Bench<Scalar> bench(HalfSpace{kRoom.middle(), kTilted}, kRoom, {.sphere = sphere, .slices = 20});
    CAPTURE(sphere);
    const Vec3d touching = kRoom.middle() + kDrill.tip_radius * kTilted;
    const auto pose = [&](double depth) { return tool_at(touching - depth * kTilted, kTilted); };
    const double k_v = kGains.stiffness;
    bench.lead_to(pose(-1e-3), pose(0), 50);
    double before = 0;
    for (const double depth : {0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.003, 0.0035, 0.004}) {
      const auto out = bench.lead_to(pose(depth - 0.0005), pose(depth), 50);
      const Wrenchd w = in_double(out.wrench);
      CHECK(out.status == Status::kOk);
      CHECK(angle_deg(w.force, kTilted) <= 0.5);
      CHECK(w.torque.norm() <= 0.01 * std::max(0.1, w.force.norm()) * kDrill.tip_radius + 1e-4);
      if (depth > 0.0005) {
        // Of those that touch the one in the middle is the stiffest alone, all together at most their number as stiff.
        const double least = k_v * bench.tool.contact_stiffness() / (k_v + bench.tool.contact_stiffness());
        const double felt = (w.force.norm() - before) / 0.0005;
        CHECK(felt >= 0.98 * least);
        CHECK(felt <= 1.02 * k_v);
      }
      before = w.force.norm();
    }
    // 16 voxels deep, at the force limit.
    const auto out = bench.lead_to(pose(0.004), pose(16 * kVoxel), 100);
    CHECK(static_cast<double>(out.wrench.force.norm()) == doctest::Approx(3.3).epsilon(1e-4));
    CHECK(bench.tool.penetration() <= kVoxel);
    CHECK(bench.tool.penetration() <= 0.3 * kVoxel);
  }
}

// A ball is the same whichever way it is turned: in a pit that it milled itself, rough as voxels are, it turns freely
// and its force stays.
TEST_CASE("a ball turned in its pit feels nothing of it") {
  const Burr burr{.tip_radius = 0.0009, .shaft_radius = 0.0004, .shaft_length = 0.020};  // three voxels
  for (const int sphere : {26, 100}) {
    Bench<> bench(HalfSpace{kRoom.middle(), Vec3d::UnitZ()}, kRoom, {.sphere = sphere, .slices = 20}, burr);
    CAPTURE(sphere);
    const Vec3d bottom = kRoom.middle() - 0.0005 * Vec3d::UnitZ() + 1e-4 * Vec3d(1, 2, 0);
    bench.map.cut(SphereCutter(kRoom.middle() + 0.003 * Vec3d::UnitZ(), bottom, burr.tip_radius));
    const Vec3d pressed = bottom - 0.0025 * Vec3d::UnitZ();
    const auto pose = [&](double angle) { return tool_at(pressed, Vec3d(std::sin(angle), 0, std::cos(angle))); };
    bench.lead_to(tool_at(kRoom.middle() + 0.002 * Vec3d::UnitZ(), Vec3d::UnitZ()), pose(0), 200);
    Vec3d resting = Vec3d::Zero();
    double torque = 0, change = 0;
    for (int i = 0; i < 600; ++i) {
      const Wrenchd w = in_double(bench.at(pose(0.4 * std::sin(0.01 * std::max(0, i - 20)))).wrench);
      if (i == 20) resting = w.force;
      torque = std::max(torque, w.torque.norm());
      if (i > 20) change = std::max(change, (w.force - resting).norm());
    }
    CHECK(resting.z() > 1.5);
    CHECK(torque < 1e-6);
    CHECK(change < 1e-3 * resting.norm());
  }
}

// In a bowl of radius ρ the ball's centre goes on a ball of radius ρ − R, and rests where that is nearest to the
// device: known in closed form, however far the device pulls.
TEST_CASE("in a bowl nearly as round as the ball the tool follows without going to and fro") {
  const Vec3d centre = kRoom.middle();
  for (const double roundness : {1.2, 1.4, 2.0}) {
    const double free = (roundness - 1) * kDrill.tip_radius;
    Bench<> bench(Both{Hollow{Ball{centre, roundness * kDrill.tip_radius}}, HalfSpace{centre, Vec3d::UnitZ()}}, kRoom);
    for (const double pull : {0.001, 0.002, 0.004}) {
      CAPTURE(roundness);
      CAPTURE(pull);
      const auto toward = [](double angle) {
        return Vec3d(std::sin(angle), 0.3 * std::sin(2 * angle), -std::cos(angle)).normalized();
      };
      const auto pose = [&](const Vec3d& u) { return tool_at(centre + (free + pull) * u, Vec3d::UnitZ()); };
      bench.tool.reset();
      bench.lead_to(tool_at(centre, Vec3d::UnitZ()), pose(toward(0)), 100);
      constexpr int kTicks = 500;
      double off = 0, jerk = 0, steps = 0;
      Vec3d before = Vec3d::Zero(), change = Vec3d::Zero();
      for (int i = 0; i < kTicks; ++i) {
        const Vec3d u = toward(1e-3 * i);
        const Vec3d force = in_double(bench.at(pose(u)).wrench).force;
        off = std::max(off, std::sin(angle_deg(force, -u) / 57.29577951308232) * pull);
        if (i > 1) jerk = std::max(jerk, (force - before - change).norm() / force.norm());
        change = force - before;
        before = force;
        steps += bench.tool.steps() / static_cast<double>(kTicks);
      }
      CHECK(off < 0.15 * kVoxel);
      CHECK(jerk < 0.015);
      CHECK(steps < 3.2);
    }
  }
}

struct Sliding {
  double direction_p99 = 0, mean_force = 0, ripple = 0, torque_most = 0;
  int bounded = 0;
};

// Held a fixed way beyond touching and slid along a shape.
template <class Shape>
Sliding slide(const Shape& shape, const Vec3d& n, int sphere) {
  Bench<> bench(shape, kRoom, {.sphere = sphere, .slices = 20});
  const Vec3d t = n.unitOrthogonal();
  std::vector<double> angles, forces;
  Sliding s;
  for (int i = 0; i < 1500; ++i) {
    Vec3d p = kRoom.middle() + (i < 300 ? 0 : (i - 300) * 1e-3 * 0.003) * t;
    for (int k = 0; k < 4; ++k) p -= (shape(p) - kDrill.tip_radius) * outward_normal(shape, p);
    const Vec3d out = outward_normal(shape, p);
    const double press = 1.0 / kGains.stiffness * std::min(1.0, i / 200.0) - 1e-4 * std::max(0.0, 1 - i / 100.0);
    const auto r = bench.at(tool_at(p - press * out, (n + 0.3 * t).normalized()));
    s.bounded += r.status == Status::kOk ? 0 : 1;
    if (i < 300) continue;
    const Wrenchd w = in_double(r.wrench);
    angles.push_back(angle_deg(w.force, out));
    forces.push_back(w.force.norm());
    s.torque_most = std::max(s.torque_most, w.torque.norm());
  }
  std::sort(angles.begin(), angles.end());
  s.direction_p99 = angles[angles.size() * 99 / 100];
  for (const double f : forces) s.mean_force += f / static_cast<double>(forces.size());
  for (const double f : forces)
    s.ripple += (f - s.mean_force) * (f - s.mean_force) / static_cast<double>(forces.size());
  s.ripple = std::sqrt(s.ripple);
  return s;
}

TEST_CASE("slid over plane, ball and socket at 1 N: direction, ripple, torque") {
  const double h = kVoxel;
  for (const int sphere : {26, 200}) {
    CAPTURE(sphere);
    const auto check = [&](const std::string& name, const Sliding& s) {
      CAPTURE(name);
      CHECK(s.direction_p99 <= 1);
      CHECK(s.ripple < 0.01);
      CHECK(s.mean_force == doctest::Approx(1).epsilon(0.02));
      CHECK(s.torque_most <= 0.01 * s.mean_force * 0.02);
      CHECK(s.bounded == 0);
      MESSAGE(name, ", ", sphere, " vertices: direction p99 ", s.direction_p99, " deg, ripple ", s.ripple, " N rms");
    };
    check("plane", slide(HalfSpace{kRoom.middle(), kTilted}, kTilted, sphere));
    check("ball", slide(Ball{kRoom.middle() - 20 * h * kTilted, 20 * h}, kTilted, sphere));
    const Vec3d along = kTilted.unitOrthogonal().cross(kTilted);
    check("cylinder", slide(Rod{kRoom.middle() - 20 * h * kTilted, along, 20 * h}, kTilted, sphere));
  }
}

// The wrench is the coupling's at the device's pose: force and torque are −∂V of what the springs hold, V(X_dev) the
// least energy. So closed paths do no work, up to where the search ends.
TEST_CASE("closed paths with rotation, tip and shaft in contact: no net work") {
  const unsigned seed = 23;
  CAPTURE(seed);
  Random random(seed);
  Bench<double> bench(Ball{kRoom.middle() - 20 * kVoxel * kTilted, 20 * kVoxel}, kRoom,
                      {.sphere = 100, .slices = 40, .per_slice = 12});
  double net = 0, path = 0, worst = 0;
  for (int loop = 0; loop < 12; ++loop) {
    const bool shaft = loop % 3 == 2;
    const Vec3d n = (kTilted + 0.4 * random.unit()).normalized();
    const Vec3d centre = kRoom.middle() - 20 * kVoxel * kTilted;
    const Vec3d axis = shaft ? n.unitOrthogonal() : Vec3d((n + 0.4 * random.unit()).normalized());
    const Vec3d tip = shaft ? Vec3d(centre + (20 * kVoxel + 0.0005) * n - 0.006 * axis)
                            : Vec3d(centre + (20 * kVoxel + kDrill.tip_radius - random.uniform(0.0005, 0.0015)) * n);
    const Vec3d a = 0.0006 * random.unit(), b = 0.0006 * random.unit(), turn = 0.1 * random.unit();
    const auto pose = [&](double phase) {
      const double c = 0.5 * (1 - std::cos(phase)), s = std::sin(phase);
      return make_pose<double>(rotation_from_vector(Vec3d(c * turn)) * tool_at(tip, axis).linear(),
                               tip + 0.004 * (1 - c) * n * (phase < 0 ? 1 : 0) + c * a + s * b);
    };
    // In from outside, once round, measured on the second round.
    bench.tool.reset();
    const Posed start = pose(0);
    bench.lead_to(make_pose<double>(start.linear(), start.translation() + 0.004 * n), start, 100);
    PathWork work(start, in_double(bench.at(start).wrench));
    constexpr int kSteps = 1200;
    for (int i = 1; i <= 2 * kSteps; ++i) {
      const Posed X = pose(2 * 3.14159265358979323846 * i / kSteps);
      const Wrenchd w = in_double(bench.at(X).wrench);
      if (i > kSteps)
        work.go(X, w);
      else
        work = PathWork(X, w);
    }
    CHECK(work.length > 1e-6);
    net += std::abs(work.net);
    path += work.length;
    worst = std::max(worst, std::abs(work.net) / work.length);
  }
  MESSAGE("net work over ", net / path, " of the path's, worst ", worst);
  CHECK(net / path <= 2e-3);
  CHECK(worst <= 1e-2);
}

// --- Walls, jumps, starts
// -----------------------------------------------------------------------------------------------

TEST_CASE("a wall of one voxel holds at any speed up to 1 m/s, against tip and shaft") {
  const RasterOptions o{.size = {80, 80, 80}, .image = Image::kBinary};
  const double middle = o.middle().z() + 0.5 * kVoxel;  // on a lattice plane: one layer of voxels
  const Plate wall{Vec3d(o.middle().x(), o.middle().y(), middle), Vec3d::UnitZ(), kVoxel};
  for (const double speed : {0.01, 0.1, 0.3, 1.0})
    for (const bool lying : {false, true}) {
      Bench<> bench(wall, o);
      CAPTURE(speed);
      CAPTURE(lying);
      const double radius = lying ? kDrill.shaft_radius : kDrill.tip_radius;
      const Vec3d axis = lying ? Vec3d::UnitX() : Vec3d::UnitZ();
      const Vec3d from(o.middle().x() - (lying ? 0.008 : 0), o.middle().y(), middle + radius + 2 * kVoxel);
      double lowest = 1;
      for (int i = 0; i * speed * 1e-3 < 0.006; ++i) {
        const Vec3d p = from - Vec3d(-0.3, 0.2, 1).normalized() * (i * speed * 1e-3);
        static_cast<void>(bench.at(tool_at(p, axis)));
        lowest = std::min(lowest, bench.tool.proxy_pose().translation().z() - middle);
      }
      CHECK(lowest > (lying ? kDrill.shaft_radius : kDrill.tip_radius) - kVoxel);
    }
}

// A steady slide is told ahead, by up to half a voxel beyond what is free: not through a wall that stands in its way,
// wherever that lies between the voxels.
TEST_CASE("slid along a floor, no wall of a voxel and a half that stands on it is jumped") {
  const RasterOptions o{.size = {64, 48, 48}};
  const Vec3d floor = o.middle() - 0.003 * Vec3d::UnitZ();
  for (int offset = 0; offset < 5; ++offset) {
    const double wall = o.middle().x() + 0.2 * offset * kVoxel;
    Bench<> bench(Either{HalfSpace{floor, Vec3d::UnitZ()},
                         Plate{Vec3d(wall, o.middle().y(), floor.z()), Vec3d::UnitX(), 1.5 * kVoxel}},
                  o);
    for (const double speed : {0.03, 0.1, 0.2, 0.3, 1.0}) {
      for (const double aslant : {0.0, 0.5, 1.0}) {
        CAPTURE(offset);
        CAPTURE(speed);
        CAPTURE(aslant);
        bench.tool.reset();
        const Vec3d way = Vec3d(1, aslant, 0).normalized();
        const Vec3d start(wall - 0.006, o.middle().y() - 0.005 * aslant, floor.z() + kDrill.tip_radius);
        bench.lead_to(tool_at(start + 1e-3 * Vec3d::UnitZ(), Vec3d::UnitZ()),
                      tool_at(start - 1e-3 * Vec3d::UnitZ(), Vec3d::UnitZ()), 40);
        double farthest = -1;
        for (int i = 0; i * speed * 1e-3 * way.x() < 0.009; ++i) {
          const Vec3d p = start - 1e-3 * Vec3d::UnitZ() + i * speed * 1e-3 * way;
          static_cast<void>(bench.at(tool_at(p, Vec3d::UnitZ())));
          farthest = std::max(farthest, bench.tool.proxy_pose().translation().x() - wall);
        }
        CHECK(farthest < -kDrill.tip_radius + 1.5 * kVoxel);
        CHECK(farthest > -kDrill.tip_radius - kVoxel);
      }
    }
  }
}

// Blurred, a wall of one voxel is a tenth to half a voxel deep in its middle, and what is smoothed points out at the
// wrong face before that.
TEST_CASE("a blurred wall of one voxel holds wherever it lies between the voxels") {
  const RasterOptions o{.size = {48, 48, 48}};
  int walls = 0;
  for (int offset = 0; offset < 10; ++offset) {
    const double height = o.middle().z() + 0.1 * offset * kVoxel;
    const Plate wall{Vec3d(o.middle().x(), o.middle().y(), height), Vec3d::UnitZ(), kVoxel};
    for (const double stiffness : {800.0, 3000.0}) {
      CoupledOptions gains = kGains;
      gains.stiffness = stiffness;
      Bench<> bench(wall, o, SurfaceCounts::thesis(), kDrill, gains);
      const DepthField<double> depth(bench.map);
      double deepest = -1;
      for (double z = -0.5; z <= 0.5; z += 0.01)
        deepest = std::max(deepest, depth.value(Vec3d(o.middle().x(), o.middle().y(), height + z * kVoxel)));
      if (deepest < 0.1 * kVoxel) continue;  // the image has next to nothing
      ++walls;
      for (const double speed : {0.01, 0.03, 0.1, 0.3, 1.0}) {
        CAPTURE(offset);
        CAPTURE(stiffness);
        CAPTURE(speed);
        bench.tool.reset();
        double pushed = 0, lowest = 1;
        for (int i = 0; pushed < 3 && i * speed * 1e-3 < 0.008; ++i) {
          const Vec3d p(o.middle().x() + 1e-4, o.middle().y() + 5e-5, height + 0.0021 - i * speed * 1e-3);
          pushed = static_cast<double>(bench.at(tool_at(p, Vec3d::UnitZ())).wrench.force.z());
          lowest = std::min(lowest, bench.tool.proxy_pose().translation().z() - height);
        }
        CHECK(pushed >= 3);
        CHECK(lowest > kDrill.tip_radius - kVoxel);
      }
    }
  }
  MESSAGE(walls, " walls");
  CHECK(walls >= 10);
}

TEST_CASE("jumps of 50 mm: finite, within limits at once, caught up within ticks") {
  const RasterOptions o{.size = {200, 40, 40}};
  const Either bones{Block{o.middle() - Vec3d(0.02, 0, 0), Vec3d(0.004, 0.02, 0.02)},
                     Block{o.middle() + Vec3d(0.022, 0, 0), Vec3d(0.004, 0.02, 0.02)}};
  Bench<> bench(bones, o);
  const auto pose = [&](double x) { return tool_at(o.middle() + Vec3d(x, 0, 0), Vec3d::UnitZ()); };
  const auto jump = [&](double from, double to, int most_ticks) {
    CAPTURE(from);
    CAPTURE(to);
    bench.tool.reset();
    bench.lead_to(pose(from), pose(from), 3);
    int late = 0;
    for (int i = 0; i < 60; ++i) {
      const auto out = bench.at(pose(to));
      CHECK(is_finite(out.wrench));
      CHECK(out.wrench.force.norm() <= 3.3F * 1.0001F);
      CHECK(out.wrench.torque.norm() <= 0.188F * 1.0001F);
      if (i == 0) CHECK(out.status >= Status::kJump);
      if (out.status != Status::kOk) late = i;
    }
    CHECK(late <= most_ticks);
  };
  jump(-0.012, 0.012, 0);  // from free to free: at once
  jump(0.012, -0.012, 0);
  jump(0.027, -0.022, 45);  // across a block's far side into the other block: step by step, held on the way
  jump(0.0, 0.022, 45);
}

TEST_CASE("a start inside bone comes out, or says that it cannot") {
  Bench<> bench(HalfSpace{kRoom.middle(), Vec3d::UnitZ()}, kRoom);
  // The ball's deepest point 3.5 voxels deep: within the depths' reach.
  const Posed inside = tool_at(kRoom.middle() + Vec3d(0, 0, kDrill.tip_radius - 3.5 * kVoxel), Vec3d::UnitZ());
  auto out = bench.at(inside);
  int ticks = 1;
  for (; out.status != Status::kOk && ticks < 50; ++ticks) out = bench.at(inside);
  CHECK(ticks <= 5);
  CHECK(angle_deg(out.wrench.force.cast<double>(), Vec3d::UnitZ()) < 2);
  CHECK(bench.tool.penetration() < kVoxel);
  // The whole tool deep inside: no way out is known. A finite wrench, and a status as long as it lasts.
  Bench<> buried(HalfSpace{kRoom.middle() + Vec3d(0, 0, 1), Vec3d::UnitZ()}, kRoom, SurfaceCounts::thesis(),
                 Burr{.shaft_length = 0});
  for (int i = 0; i < 20; ++i) {
    const auto r = buried.at(tool_at(kRoom.middle(), Vec3d::UnitZ()));
    CHECK(r.status == Status::kStartedInside);
    CHECK(r.wrench.force.norm() < 1e-3F);
  }
}

// --- Work
// -----------------------------------------------------------------------------------------------------------------

// What is beyond the volume is air: in a volume that ends just above the bone, with all of the shaft outside, the tool
// feels what it feels in one that holds the shaft too. It turns as it slides, so that the shaft's end goes 3 voxels a
// tick.
TEST_CASE("a shaft outside the volume is in nobody's way") {
  const RasterOptions large{.size = {72, 72, 140}};
  RasterOptions small = large;
  small.size[2] = 40;
  const Vec3d centre(large.middle().x(), large.middle().y(), 12 * kVoxel);
  const Ball ball{centre, 18 * kVoxel};
  Bench<> in_large(ball, large), in_small(ball, small);
  const double R = 18 * kVoxel + kDrill.tip_radius;
  for (int i = 0; i < 2000; ++i) {
    const double angle = 0.5 * std::sin(2 * 3.14159265358979 * i / 500.0) * std::min(1.0, i / 100.0);
    const Vec3d n = Vec3d(std::sin(angle), 0.1, std::cos(angle)).normalized();
    const Posed X = tool_at(centre + (R - std::min(0.001, i * 1e-5)) * n, n);
    const auto a = in_large.at(X);
    const auto b = in_small.at(X);
    CAPTURE(i);
    CHECK(a.status == Status::kOk);
    CHECK(b.status == Status::kOk);
    CHECK((a.wrench.force - b.wrench.force).norm() <= 0.01F * std::max(0.05F, a.wrench.force.norm()));
    CHECK((a.wrench.torque - b.wrench.torque).norm() <= 2e-5F);
    if (i > 100) CHECK(static_cast<double>(b.wrench.force.norm()) == doctest::Approx(0.7).epsilon(0.03));
  }
}

TEST_CASE("samples a tick are bounded, and few while the tool slides") {
  Bench<> bench(HalfSpace{kRoom.middle(), kTilted}, kRoom);
  const auto field = bench.tool.field(bench.bone, kRoom.isovalue());
  const CountingField counting(field);
  const std::int64_t most = 24 * (3 * 208 + 32 * 186) + 2 * 208;  // what the header promises, for 186 vertices
  std::int64_t sliding = 0;
  Random random(9);
  for (int i = 0; i < 400; ++i) {
    counting.samples = counting.normals = 0;
    const Vec3d t = kTilted.unitOrthogonal();
    Posed X = tool_at(kRoom.middle() + (kDrill.tip_radius - 1e-3) * kTilted + 5e-5 * i * t, kTilted);
    if (i > 200) X = tool_at(kRoom.middle() + 0.004 * random.unit(), random.unit());
    static_cast<void>(render_at(bench.tool, counting, X));
    CHECK(bench.tool.steps() <= Coupled<>::kMostSteps + 1);
    CHECK(counting.samples + counting.normals <= most);
    if (i > 50 && i <= 200) sliding = std::max(sliding, counting.samples + counting.normals);
  }
  CHECK(sliding <= 1500);
  MESSAGE("samples and gradients in a sliding tick: ", sliding);
}

// --- Friction
// ---------------------------------------------------------------------------------------------------------------

TEST_CASE("friction: sticks without creep, slips on the cone's edge") {
  const double mu_s = 0.3, mu_k = 0.2;
  Bench<float, Coulomb> bench(HalfSpace{kRoom.middle(), kTilted}, kRoom, SurfaceCounts::thesis(), kDrill, kGains,
                              Coulomb(mu_s, mu_k));
  const Vec3d t = kTilted.unitOrthogonal();
  const double deep = 0.002;
  const auto pose = [&](double along) {
    return tool_at(kRoom.middle() + (kDrill.tip_radius - deep) * kTilted + along * t, kTilted);
  };
  bench.lead_to(tool_at(kRoom.middle() + (kDrill.tip_radius + 1e-4) * kTilted, kTilted), pose(0), 100);
  // Within the cone: the virtual tool stays.
  bench.lead_to(pose(0), pose(0.25 * deep), 50);
  const Vec3d stuck = bench.tool.proxy_pose().translation().cast<double>();
  for (int i = 0; i < 2000; ++i) static_cast<void>(bench.at(pose(0.25 * deep)));
  const double creep = (bench.tool.proxy_pose().translation().cast<double>() - stuck).norm() / 2;
  MESSAGE("creep while stuck: ", creep * 1e6, " um/s");
  CHECK(creep < 1e-6);
  // Beyond it: the tangential force is μ_k times the normal one.
  bench.lead_to(pose(0.25 * deep), pose(0.6 * deep), 50);
  double worst = 0;
  for (int i = 0; i < 500; ++i) {
    const Wrenchd w = in_double(bench.at(pose(0.6 * deep + 1e-5 * i)).wrench);
    const double normal = w.force.dot(kTilted);
    const double along = (w.force - normal * kTilted).norm();
    if (i > 50) worst = std::max(worst, std::abs(along / (mu_k * normal) - 1));
  }
  MESSAGE("slipping: off the cone by ", 100 * worst, " %");
  CHECK(worst <= 0.05);
}

// No vertex meets the edge: what holds it lies between them.
TEST_CASE("friction: edges hold between vertices") {
  const Vec3d up = Vec3d::UnitZ(), top = kRoom.middle() + Vec3d(3e-5, 0, 0);
  for (const auto& [degrees, most] : {std::pair(90.0, 0.2e-3), std::pair(30.0, 0.6e-3)}) {
    const double half = degrees / 2 * 0.017453292519943295;
    const Vec3d a(std::cos(half), 0, std::sin(half)), b(-std::cos(half), 0, std::sin(half));
    Bench<float, Coulomb> bench(Both<HalfSpace, HalfSpace>{{top, a}, {top, b}}, kRoom, SurfaceCounts::thesis(), kDrill,
                                kGains, Coulomb(0.3, 0.3));
    double deepest = 0;
    for (int i = 0; i < 20; ++i) {
      const Vec3d touching = top + kDrill.tip_radius * up + Vec3d(1e-5 * i, 4e-5 * i, 0);
      bench.tool.reset();
      bench.lead_to(tool_at(touching + 1e-4 * up, up), tool_at(touching - 1.2e-3 * up, up), 100);
      deepest = std::max(deepest, (touching - bench.tool.proxy_pose().translation().cast<double>()).z());
    }
    MESSAGE("on an edge of ", degrees, " degrees the tool sinks in by ", 1e3 * deepest, " mm");
    CHECK(deepest < most);
  }
}

// Of a motion of 2 µm on a wall the virtual tool takes a fiftieth: less than what ends a search.
TEST_CASE("friction: a motion too small for a search is felt in full") {
  Bench<double, Coulomb> bench(HalfSpace{kRoom.middle(), Vec3d::UnitZ()}, kRoom, SurfaceCounts::thesis(), kDrill,
                               kGains, Coulomb(0.3, 0.3));
  const double k_v = kGains.stiffness, k_c = bench.tool.options().contact_stiffness(kVoxel, true);
  const Vec3d touching = kRoom.middle() + kDrill.tip_radius * Vec3d::UnitZ();
  const auto pose = [&](double depth) { return tool_at(touching - depth * Vec3d::UnitZ(), Vec3d::UnitZ()); };
  bench.lead_to(pose(-1e-3), pose(1e-3), 100);
  const auto force = [&](double depth) { return in_double(bench.at(pose(depth)).wrench).force.z(); };
  double off = 0, before = force(1e-3);
  for (int i = 0; i < 40; ++i) {
    const bool in = i % 2 == 0;
    const double now = force(1e-3 + (in ? 2e-6 : 0));
    off = std::max(off, std::abs(std::abs(now - before) / 2e-6 * (k_v + k_c) / (k_v * k_c) - 1));
    before = now;
  }
  MESSAGE("felt off the springs in series by ", 100 * off, " %");
  CHECK(off <= 0.002);
}

TEST_CASE("friction takes energy on closed paths, never gives") {
  Bench<double, Coulomb> bench(Ball{kRoom.middle() - 20 * kVoxel * kTilted, 20 * kVoxel}, kRoom,
                               {.sphere = 50, .slices = 20}, kDrill, kGains, Coulomb(0.3, 0.3));
  Random random(31);
  double most = -1;
  for (int loop = 0; loop < 10; ++loop) {
    const Vec3d a = 0.001 * random.unit(), b = 0.001 * random.unit(), turn = 0.2 * random.unit();
    const Posed out =
        tool_at(kRoom.middle() + (kDrill.tip_radius + 0.0025) * kTilted, (kTilted + 0.3 * random.unit()).normalized());
    PathWork work(out, in_double(bench.at(out).wrench));
    for (int i = 1; i <= 3000; ++i) {
      const double phase = 2 * 3.14159265358979323846 * i / 3000;
      const double in = 0.5 * (1 - std::cos(phase)), s = std::sin(phase), s2 = std::sin(2 * phase);
      const Posed X = make_pose<double>(rotation_from_vector(Vec3d(s * turn)) * out.linear(),
                                        out.translation() - 0.0045 * in * kTilted + s * a + s2 * b);
      work.go(X, in_double(bench.at(X).wrench));
    }
    most = std::max(most, work.net / work.length);
  }
  MESSAGE("most work done on the hand: ", most, " of the path's");
  CHECK(most < 0);
}

TEST_CASE("what is felt has contacts, which hold it together") {
  const unsigned seed = 3;
  CAPTURE(seed);
  Random random(seed);
  constexpr double kRadius = 16 * kVoxel;
  Bench<float> bench(Ball{kRoom.middle(), kRadius}, kRoom);
  std::vector<double> off;
  for (int loop = 0; loop < 60; ++loop) {
    const Vec3d n = random.unit(), axis = (n + 0.5 * random.unit()).normalized(), aside = n.unitOrthogonal();
    const double depth = random.uniform(0.1, 1) * kDrill.tip_radius;
    bench.tool.reset();
    // Down in ten ticks, then along.
    for (int i = 0; i <= 30; ++i) {
      const double high = i < 10 ? 2e-3 * (1 - i / 10.0) : 0, along = i > 10 ? 3e-5 * (i - 10) : 0;
      const Vec3d m = (n + along / kRadius * aside).normalized();
      const auto out = bench.at(tool_at(kRoom.middle() + (kRadius + kDrill.tip_radius - depth + high) * m, axis));
      if (!(out.wrench.force.norm() > 0.05F)) continue;
      REQUIRE(!bench.tool.contacts().empty());
      CHECK(out.contact.count > 0);
      Vec3<float> sum = Vec3<float>::Zero();
      for (const auto& c : bench.tool.contacts()) sum += c.force;
      off.push_back(static_cast<double>((sum - out.wrench.force).norm() / out.wrench.force.norm()));
    }
  }
  std::sort(off.begin(), off.end());
  MESSAGE("contact forces off the hand's by ", off[off.size() / 2], " (median), ", off.back(), " at most");
  CHECK(off[off.size() / 2] <= 1e-3);
  CHECK(off.back() <= 0.1);
}

// What the coupling, the contacts' springs and friction's hold. Between two ticks the hand moves and stretches the
// coupling; then the tool is let go, which may only lose of it.
TEST_CASE("no tick adds to what the springs hold, with friction, as places come and go along a shaft") {
  const unsigned seed = 21;
  CAPTURE(seed);
  const Vec3d centre = kRoom.middle();
  const double R = 20 * kVoxel;
  Bench<float, Coulomb> bench(Ball{centre, R}, kRoom, SurfaceCounts::thesis(), kDrill, kGains, Coulomb(0.3, 0.3));
  Random random(seed);
  double most = 0, gained = -1;
  for (int loop = 0; loop < 150; ++loop) {
    const Vec3d n = random.unit(), axis = n.unitOrthogonal();
    const double depth = random.uniform(0.15, 0.7) * kDrill.shaft_radius;
    Vec3d move[3], turn[2];
    for (Vec3d& m : move) {
      const Vec3d u = random.unit();
      m = random.uniform(0.3, 1) * 5e-4 * (u - u.dot(n) * n);
    }
    for (Vec3d& t : turn) t = random.uniform(0.2, 1) * 0.05 * random.unit();
    const Posed start = tool_at(centre + (R + kDrill.shaft_radius + 1.2e-3) * n - 6e-3 * axis, axis);
    const auto pose = [&](double phase) {
      const double s = std::sin(phase), c = 0.5 * (1 - std::cos(phase)), s2 = std::sin(2 * phase);
      const Vec3d w = s * turn[0] + 0.5 * s2 * turn[1];
      return make_pose<double>(
          rotation_from_vector(w) * start.linear(),
          start.translation() - c * (1.2e-3 + depth) * n + s * move[0] + s2 * move[1] + c * move[2]);
    };
    const auto held = [&](const Posed& X_device) {
      const Posed X = bench.tool.proxy_pose().template cast<double>();
      const CouplingSpring spring{kGains.stiffness, kGains.rotational_stiffness, kGains.force, kGains.torque};
      double energy =
          spring.energy((X_device.translation() - X.translation()).norm(), turn_between(X, X_device).norm());
      for (const auto& c : bench.tool.contacts())
        energy += static_cast<double>(c.force.squaredNorm()) / (2 * bench.tool.contact_stiffness());
      return energy;
    };
    bench.tool.reset();
    PathWork work(start, in_double(bench.at(start).wrench));
    constexpr int kSteps = 1000;
    for (int i = 1; i <= kSteps; ++i) {
      const Posed X = pose(2 * 3.14159265358979323846 * i / kSteps);
      const double before = held(X);
      work.go(X, in_double(bench.at(X).wrench));
      most = std::max(most, held(X) - before);
    }
    gained = std::max(gained, work.net / work.length);
  }
  MESSAGE("most that a tick added: ", 1e6 * most, " uJ; most work done on the hand: ", gained, " of a path's");
  CHECK(most <= 1e-6);
  CHECK(gained < 0);
}

TEST_CASE("friction: a law that holds nothing is as none, to the bit") {
  const Ball ball{kRoom.middle() - 20 * kVoxel * kTilted, 20 * kVoxel};
  Bench<float> none(ball, kRoom, SurfaceCounts::thesis(), kDrill, kGains);
  Bench<float, Coulomb> zero(ball, kRoom, SurfaceCounts::thesis(), kDrill, kGains, Coulomb(0, 0));
  int touching = 0;
  for (int i = 0; i < 600; ++i) {
    const double phase = 0.02 * i;
    const Posed X = tool_at(kRoom.middle() + (kDrill.tip_radius + 0.001 * std::cos(phase)) * kTilted,
                            (kTilted + 0.3 * Vec3d(std::sin(3 * phase), std::cos(2 * phase), 0)).normalized());
    const auto a = none.at(X), b = zero.at(X);
    touching += a.contact.count > 0 ? 1 : 0;
    REQUIRE(a.wrench == b.wrench);
    REQUIRE(none.tool.proxy_pose().matrix() == zero.tool.proxy_pose().matrix());
  }
  CHECK(touching > 100);
}

// --- In a scene
// ---------------------------------------------------------------------------------------------------------------

TEST_CASE("drilling: bone gives way under the virtual tool, without a kick") {
  RasterOptions o{.size = {64, 64, 64}};
  for (const bool at_once : {true, false}) {
    CAPTURE(at_once);
    Bench<> bench(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
    const auto drill = [&](auto milling) {
      HapticScene scene{bench.bone, o.isovalue(), bench.tool, milling};
      double removed = 0, step = 0, deepest = 0;
      Vec3d before = Vec3d::Zero();
      for (int i = 0; i < 2500; ++i) {
        const double down = std::min(i, 1500) * 2e-6, across = std::max(0, i - 1500) * 4e-6;
        const Posed X = tool_at(o.middle() + Vec3d(across, 0, kDrill.tip_radius + 2e-4 - down), Vec3d::UnitZ());
        const TickResult r = scene.tick({.X_WT = X, .spindle_on = true}, 1e-3);
        removed += r.removed_mm3;
        step = std::max(step, (r.wrench.force - before).norm());
        deepest = std::max(deepest, scene.renderer().penetration());
        before = r.wrench.force;
      }
      MESSAGE("removed ", removed, " mm3, largest step of force ", step, " N, virtual tool at most ", deepest / kVoxel,
              " voxels deep");
      CHECK(removed > 20);
      CHECK(step <= 0.2);
      CHECK(deepest <= kVoxel);
    };
    if (at_once)
      drill(Milling{});
    else
      drill(Milling{{.rate = 2e4}});
  }
}

TEST_CASE("the map of another bone is refused; a force-only device pays for translation alone") {
  RasterOptions o{.size = {24, 24, 24}};
  Bench<> bench(Ball{o.middle(), 6 * kVoxel}, o);
  o.size = {24, 24, 30};
  auto other = rasterise<std::uint8_t>(Ball{o.middle(), 6 * kVoxel}, o);
  CHECK_THROWS_AS((HapticScene{other, o.isovalue(), bench.tool}), std::invalid_argument);

  Bench<float, Frictionless, TranslationOnly> plane(HalfSpace{kRoom.middle(), kTilted}, kRoom);
  const auto out = plane.lead_to(tool_at(kRoom.middle() + 0.002 * kTilted, kTilted),
                                 tool_at(kRoom.middle() + (kDrill.tip_radius - 0.001) * kTilted, kTilted), 100);
  CHECK(out.wrench.torque.norm() == 0);
  CHECK(static_cast<double>(out.wrench.force.norm()) == doctest::Approx(0.7).epsilon(0.03));
  CHECK_THROWS_AS(Bench<>(HalfSpace{kRoom.middle(), kTilted}, o, SurfaceCounts::thesis(), kDrill, {.stiffness = 0}),
                  std::invalid_argument);
  CHECK_THROWS_AS(Bench<>(HalfSpace{kRoom.middle(), kTilted}, o, SurfaceCounts::thesis(), kDrill, {.force = -1}),
                  std::invalid_argument);
  CHECK_THROWS_AS(Bench<>(HalfSpace{kRoom.middle(), kTilted}, o, SurfaceCounts::thesis(), kDrill, {.bite = 5}),
                  std::invalid_argument);
}

// --- Closed loop
// ----------------------------------------------------------------------------------------------------------------

/// Whether a light device without friction, pushed on the bone with 1 N and put 2 µm off its rest, settles.
template <class Shape>
bool settles(Bench<>& bench, const Shape&, const Vec3d& rest, const Vec3d& toward, const Vec3d& axis,
             double stiffness) {
  CoupledOptions gains = kGains;
  gains.stiffness = stiffness;
  gains.force = 1000;
  Coupled<> tool(bench.tool.tool(), FromDepthMap(bench.map), gains);
  SimulatedDeviceOptions o;
  o.linear = {.inertia = 0.075, .damping = 0.5};
  o.hand_linear = {};
  o.X_DH = tool_at(rest + (1 / stiffness + 2e-6) * toward, axis);
  SimulatedDevice device(o);
  const auto field = tool.field(bench.bone, bench.options.isovalue());
  static_cast<void>(render_at(tool, field, tool_at(rest, axis)));  // the virtual tool comes from outside
  double early = 0, late = 0;
  for (int i = 0; i < 3000; ++i) {
    DeviceState state;
    static_cast<void>(device.read(state));
    Wrenchd w = in_double(render_at(tool, field, state.X_DH).wrench);
    w.torque.setZero();
    // A steady push of 1 N into the bone; along the surface, where nothing holds it, the device is on a rail.
    w.force = (1 + w.force.dot(toward)) * toward;
    static_cast<void>(device.write(w));
    device.advance(1e-3);
    const double swing = device.velocity().linear.norm();
    if (i >= 800 && i < 1500) early = std::max(early, swing);
    if (i >= 2300) late = std::max(late, swing);
  }
  return late < early && late < 1e-3;
}

// m = .075 kg, b = .5 N s/m, no friction: exact zero-order hold says 1002 N/m for a spring in one direction.
TEST_CASE("critical stiffness is the coupling's own on wall, groove and slot alike") {
  const double h = kVoxel;
  const RasterOptions o{.size = {80, 80, 80}};
  const auto critical = [&](auto shape, const Vec3d& rest, const Vec3d& toward, const Vec3d& axis) {
    Bench<> bench(shape, o);
    double low = 500, high = 2000;
    while (high - low > 8) {
      const double k = 0.5 * (low + high);
      (settles(bench, shape, rest, toward, axis, k) ? low : high) = k;
    }
    return 0.5 * (low + high);
  };
  const Vec3d z = Vec3d::UnitZ();
  const double R = kDrill.tip_radius;
  const double wall = critical(HalfSpace{o.middle(), z}, o.middle() + R * z, -z, z);
  // Touches both sides of a groove of 90 degrees.
  const double groove = critical(
      Either{HalfSpace{o.middle(), Vec3d(1, 0, 1).normalized()}, HalfSpace{o.middle(), Vec3d(-1, 0, 1).normalized()}},
      o.middle() + std::sqrt(2.0) * R * z, -z, z);
  const double slot = critical(Hollow{Both{HalfSpace{o.middle() + 6 * h * Vec3d::UnitX(), Vec3d::UnitX()},
                                           HalfSpace{o.middle() - 6 * h * Vec3d::UnitX(), -Vec3d::UnitX()}}},
                               o.middle() - (6 * h - R) * Vec3d::UnitX(), -Vec3d::UnitX(), z);
  MESSAGE("critical stiffness: wall ", wall, ", groove ", groove, ", slot ", slot, " N/m");
  // The felt stiffness is up to 2 % below the coupling's: so much more is stable.
  for (const double k : {wall, groove, slot}) {
    CHECK(k >= 0.98 * 1002);
    CHECK(k <= 1.04 * 1002);
  }
}

}  // namespace
