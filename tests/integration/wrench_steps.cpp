// SPDX-License-Identifier: MIT
// No wrench ever steps: one law for the whole scene, whatever the cause.
#include "device/archetypes.hpp"
#include "support/cases.hpp"
#include "support/figures.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/core/units.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/release_limit.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kStiffness = 800, kRotationalStiffness = 0.3, kRelease = 60, kRadius = 1.5e-3;
const Burr kDrill{.tip_radius = kRadius, .shaft_radius = 0.8e-3, .shaft_length = 40e-3};
const CoupledOptions kGains{
    .stiffness = kStiffness, .rotational_stiffness = kRotationalStiffness, .force = 3.3, .torque = 0.1};
constexpr double kPi = 3.14159265358979323846, kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDrawnSpeed = CoupledConstants::kDrawnSpeed;

/// Ticks a scene and compares each change of its wrench with the law, in the world's axes.
class Watch {
 public:
  template <class Scene>
  TickResult tick(Scene& scene, const Posed& X_WT, double dt = 1e-3, bool spindle_on = false) {
    const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = spindle_on}, dt);
    const Posed X_GT = relative_pose(scene.bone().X_WG(), X_WT);
    const double lever = std::sqrt(kRotationalStiffness / kStiffness);
    const Vec6d motion = motion_to(X_GT_, X_GT);
    const double moved = std::hypot(motion.head<3>().norm(), lever * motion.tail<3>().norm());
    // A jump counts as no motion here; before the first tick there is no wrench and no motion to speak of.
    const double counted = has_last_ && r.status < Status::kJump ? kStiffness * moved : 0;
    const double changed =
        std::hypot((r.wrench.force - last_.force).norm(), (r.wrench.torque - last_.torque).norm() / lever);
    beyond_.add((changed - counted) / (kRelease * dt));
    step_ = std::max(step_, (r.wrench.force - last_.force).norm());
    const Posed drawn = relative_pose(scene.bone().X_WG(), scene.visual_pose_W());
    if (has_last_ && r.status < Status::kJump) {
      // No farther than the device's points, 42 mm from T's origin at most, and kDrawnSpeed.
      const ToolMotion device = motion_between(X_GT_, X_GT);
      drawn_.add(((drawn.translation() - drawn_pose_.translation()).norm() - device.at(0.042)) / (kDrawnSpeed * dt));
      work_ += 0.5 * (r.wrench.force + last_.force).dot(motion.head<3>());
    }
    has_last_ = true;
    last_ = r.wrench;
    X_GT_ = X_GT;
    drawn_pose_ = drawn;
    return r;
  }

  /// The largest change of the wrench beyond the motion's, over the slope's; at most 1 by the law.
  [[nodiscard]] double beyond() const { return beyond_.worst(); }
  /// The same for the drawn tool.
  [[nodiscard]] double drawn() const { return drawn_.worst(); }
  /// Largest change of the force in a tick [N].
  [[nodiscard]] double step() const { return step_; }
  /// On the hand by the force [J].
  [[nodiscard]] double work() const { return work_; }
  [[nodiscard]] const Wrenchd& last() const { return last_; }

 private:
  bool has_last_ = false;
  Wrenchd last_;
  Posed X_GT_ = Posed::Identity(), drawn_pose_ = Posed::Identity();
  Figures beyond_, drawn_;
  double step_ = 0, work_ = 0;
};
constexpr double kRounding = 1 + 1e-6;

[[nodiscard]] RasterOptions image_of(int n) {
  RasterOptions o{.size = {56, 56, 56}, .spacing = Vec3d::Constant(3e-4)};
  o.blur = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1.0;
  return o;
}
[[nodiscard]] Vec3d near_middle(Random& random, const RasterOptions& o) {
  return o.middle() + o.spacing.x() * Vec3d(random.uniform(), random.uniform(), random.uniform());
}

/// The drill over a plane of bone, at a place and with a normal of chance.
struct OverPlane {
  RasterOptions image;
  Vec3d p, up;
  VoxelGrid<std::int16_t> bone;

  OverPlane(int n, Random& random)
      : image(image_of(n)),
        p(near_middle(random, image)),
        up(random.unit()),
        bone(rasterise<std::int16_t>(HalfSpace{p, up}, image)) {}
  [[nodiscard]] auto scene() { return HapticScene{bone, image.isovalue(), CoupledToolRenderer{kDrill, kGains}}; }
  /// Pose with the ball so deep below the plane.
  [[nodiscard]] Posed at(double deep) const { return tool_at(p + (kRadius - deep) * up, up); }
};

// A ball pressed deep that slides off an edge of 90 degrees and back on it has to snap, and does so by millimetres.
TEST_CASE("wrench steps: a tool slid off an edge and back changes its wrench by the law, and is drawn so") {
  Random random(1201);
  Figures beyond, drawn, work;
  for (int n = 0; n < cases(32); ++n) {
    RasterOptions o = image_of(n);
    const double spacing = std::array{3e-4, 5e-5, 1e-4, 1e-3}[static_cast<std::size_t>(n / 2 % 4)];
    o.spacing.setConstant(spacing);
    const double R = random.uniform(2, 7) * spacing;
    const Burr burr{.tip_radius = R, .shaft_radius = 0.55 * R, .shaft_length = 40e-3};
    const Vec3d p = near_middle(random, o), up = random.unit(), out = up.unitOrthogonal();
    auto bone = rasterise<std::int16_t>(Both{HalfSpace{p, up}, HalfSpace{p, out}}, o);
    const double depth = random.uniform(1, 2) * R, speed = std::pow(10, random.uniform(-2, -0.5)) * R / kRadius;
    const double dt = n % 4 == 0 ? 2.5e-4 : n % 4 == 1 ? 4e-3 : 1e-3;
    Watch watch;
    const auto slide = [&](auto& scene) {
      const auto at = [&](double along, double deep) { return tool_at(p + along * out + (R - deep) * up, up); };
      for (double deep = -R / 5; deep < depth; deep += speed * dt) watch.tick(scene, at(-2 * R, deep), dt);
      for (double along = -2 * R; along < 3 * R; along += speed * dt) watch.tick(scene, at(along, depth), dt);
      for (double along = 3 * R; along > -2 * R; along -= speed * dt) watch.tick(scene, at(along, depth), dt);
      for (double deep = depth; deep > -R / 5; deep -= speed * dt) watch.tick(scene, at(-2 * R, deep), dt);
    };
    if (n % 2 == 0) {
      HapticScene scene{bone, o.isovalue(), CoupledToolRenderer{burr, kGains}};
      slide(scene);
    } else {
      HapticScene scene{bone, o.isovalue(), CoupledToolRenderer{burr, kGains, Coulomb{0.3, 0.25}}};
      slide(scene);
    }
    CAPTURE(n);
    CHECK(watch.beyond() <= kRounding);
    CHECK(watch.drawn() <= kRounding);
    // Energy is only lost on the way.
    CHECK(watch.work() <= 0);
    beyond.add(watch.beyond());
    drawn.add(watch.drawn());
    work.add(watch.work());
  }
  MESSAGE("change beyond the motion's over the slope: ", beyond, "; of the drawn tool ", drawn, "; work [J] ", work);
  CHECK(beyond.worst() > 0.9);  // the tools did snap
}

TEST_CASE("wrench steps: the bone moves, appears and goes, and the wrench follows by the law") {
  Random random(1202);
  for (int n = 0; n < cases(12); ++n) {
    OverPlane plane(n, random);
    auto scene = plane.scene();
    Watch watch;
    for (double deep = -3e-4; deep < 3.5e-4; deep += 1e-5) watch.tick(scene, plane.at(deep));
    const Posed X = plane.at(3.5e-4);
    auto& bone = plane.bone;
    const Vec3d& up = plane.up;
    const auto rest = [&](int ticks) {
      TickResult r;
      for (int i = 0; i < ticks; ++i) r = watch.tick(scene, X);
      return r.wrench.force.norm();
    };
    const double light = rest(5);
    CHECK(light > 0.2);
    // By millimetres at once, which no patient is.
    const double by = random.uniform(1.1e-3, 4e-3);
    bone.set_X_WG(make_pose<double>(Mat3d::Identity(), by * up));
    const TickResult r = watch.tick(scene, X);
    CHECK(r.status == Status::kJump);
    CHECK(r.wrench.force.norm() <= light + kRelease * 1e-3 * kRounding);
    CHECK(rest(200) > 1.2 * light);
    // A little at a time, and turned.
    for (int i = 0; i < 50; ++i) {
      const Vec3d turned = 1e-3 * i * up.unitOrthogonal();
      bone.set_X_WG(make_pose<double>(rotation_from_vector(turned), by * up));
      watch.tick(scene, X);
    }
    // Bone under the tool goes, and comes back.
    const Vec3d c = relative_pose(bone.X_WG(), X).translation();
    REQUIRE(carve(bone, plane.image.isovalue(), SphereCutter(c, c, 6e-3)) > 0);
    CHECK(rest(200) == 0);
    bone.restore();
    rest(200);
    CAPTURE(n);
    CHECK(watch.beyond() <= kRounding);
  }
}

TEST_CASE("wrench steps: a reset, another tool and bad input leave contact where it was") {
  Random random(1203);
  for (int n = 0; n < cases(12); ++n) {
    OverPlane plane(n, random);
    auto scene = plane.scene();
    Watch watch;
    // Deeper than the tool's axis is in bone at the device's pose.
    const double depth = random.uniform(1.6e-3, 3e-3);
    for (double deep = -3e-4; deep < depth; deep += 1e-5) watch.tick(scene, plane.at(deep));
    const Posed X = plane.at(depth);
    const double before = watch.tick(scene, X).wrench.force.norm();
    REQUIRE(before > 1);
    const auto settled = [&] {
      TickResult r;
      for (int i = 0; i < 200; ++i) r = watch.tick(scene, X);
      CHECK(r.status == Status::kOk);
      return r.wrench.force.norm();
    };
    const double same = 1e-6 * before;  // what a search leaves of its last step
    scene.reset();
    CHECK(std::abs(settled() - before) <= same);
    scene.renderer().set_tool(scene.renderer().tool());
    CHECK(std::abs(settled() - before) <= same);
    CHECK(watch.beyond() <= kRounding);
    // A smaller one: farther out by half a millimetre, as deep as the other would be.
    scene.renderer().set_tool(BallAndShaft(Burr{.tip_radius = 1e-3, .shaft_radius = 0.7e-3, .shaft_length = 30e-3}));
    CHECK(std::abs(settled() - (before - kStiffness * 0.5e-3)) <= 0.0043 * before);
    CHECK(watch.beyond() <= kRounding);
    // Bad input sends zero at once: the law's one exception. From there the force rises by the slope.
    Posed bad = X;
    bad.translation().x() = kNaN;
    CHECK(scene.tick({.X_WT = bad}, 1e-3).wrench == Wrenchd::zero());
    const double risen = scene.tick({.X_WT = X}, 1e-3).wrench.force.norm();
    CHECK(risen > 0);
    CHECK(risen <= kRelease * 1e-3 * kRounding);
  }
}

// A pose that is wrong for one tick: deep in bone, with the spindle on.
TEST_CASE("wrench steps: a jump cuts nothing, with any renderer") {
  const RasterOptions o = image_of(1);
  const Vec3d p = o.middle(), up = Vec3d::UnitZ();
  const auto removed = [&](auto renderer, auto... parts) {
    double most = 0;
    for (const double deep : {1.3e-3, 2e-3, 3.5e-3, 5e-3}) {
      auto bone = rasterise<std::int16_t>(HalfSpace{p, up}, o);
      HapticScene scene{bone, o.isovalue(), renderer, parts..., Cutting{}};
      const auto at = [&](double z) {
        return TickInput{.X_WT = tool_at(p + (kRadius + z) * up, up), .spindle_on = true};
      };
      double before = 0, during = 0;
      for (int i = 0; i < 20; ++i) before += scene.tick(at(2e-4), 1e-3).removed_mm3;
      const TickResult glitch = scene.tick(at(-deep), 1e-3);
      CHECK(glitch.status == Status::kJump);
      during = glitch.removed_mm3;
      for (int i = 0; i < 20; ++i) during += scene.tick(at(2e-4), 1e-3).removed_mm3;
      CHECK(before == 0);
      most = std::max(most, during);
    }
    return most;
  };
  CHECK(removed(CoupledToolRenderer{kDrill, kGains}) == 0);
  CHECK(removed(SurfaceApproxRenderer{ToolDiscretization{kDrill, SurfaceCounts{}}}) == 0);
  CHECK(removed(LineApproxRenderer{ToolDiscretization{kDrill, LineCounts{}}}, ReleaseLimit{}) == 0);
}

/// The shell of a ball: a thin wall that a burr breaks through askew.
struct Shell {
  Vec3d centre;
  double radius, thickness;
  double operator()(const Vec3d& q) const {
    const double d = (q - centre).norm();
    return std::max(d - radius, radius - thickness - d);
  }
};

TEST_CASE("wrench steps: a hand that withdraws at any speed gets no more energy than the springs hold") {
  constexpr unsigned kSeed = 7741;
  CAPTURE(kSeed);
  Random random(kSeed);
  Figures coupled, line;
  for (int n = 0; n < cases(16); ++n) {
    OverPlane over(n, random);
    const double dt = n % 2 == 0 ? 1e-3 : 0.25e-3, deep = random.uniform(1e-3, 3e-3);
    const Vec3d side = over.up.cross(random.unit());
    const Vec3d way = (over.up + random.uniform(0, 0.8) * side).normalized();
    // Pressed at 20 mm/s, held, and withdrawn; the work on the hand from then on.
    const auto given = [&](auto scene, double speed) {
      Wrenchd last;
      for (double z = -2e-3; z < deep; z += 0.02 * dt) last = scene.tick({.X_WT = over.at(z)}, dt).wrench;
      for (double t = 0; t < 0.05; t += dt) last = scene.tick({.X_WT = over.at(deep)}, dt).wrench;
      double work = 0;
      for (double moved = 0; moved < 0.05;) {
        moved += speed * dt;
        Posed X = over.at(deep);
        X.translation() += moved * way;
        const Wrenchd now = scene.tick({.X_WT = X}, dt).wrench;
        work += 0.5 * speed * dt * (last.force + now.force).dot(way);
        last = now;
      }
      return work;
    };
    // The last tick with a force takes it for its whole way.
    const auto too_much = [](double speed, double tick) { return kStiffness * (speed * tick) * (speed * tick) / 8; };
    const auto line_scene = [&] {
      return HapticScene{over.bone, over.image.isovalue(), LineApproxRenderer{ToolDiscretization{kDrill, LineCounts{}}},
                         ReleaseLimit{}};
    };
    const double slow = given(over.scene(), 0.2), slow_line = given(line_scene(), 0.2);
    REQUIRE(slow > 1e-4);
    for (const double speed : {0.9, 1.1, 1.6, 2.5, 5.0}) {
      coupled.add((given(over.scene(), speed) - too_much(speed, dt)) / slow);
      line.add((given(line_scene(), speed) - too_much(speed, dt)) / slow_line);
    }
  }
  MESSAGE("energy given by that of a slow withdrawal: coupled ", coupled, ", Line ", line);
  CHECK(coupled.worst() < 1.01);
  CHECK(line.worst() < 1.01);
}

TEST_CASE("wrench steps: cutting forces end with the thrust, without a step, where a burr breaks through a shell") {
  Random random(1204);
  Figures beyond, ratio;
  for (const char* name : {"round-3", "round-6", "match-head-3", "pear-2.3", "diamond-2"})
    for (int n = 0; n < cases(6); ++n) {
      const NamedTool burr = tool_by_name(name);
      const RasterOptions o = image_of(n);
      const Vec3d p = near_middle(random, o), up = random.unit();
      const double radius = random.uniform(5e-3, 25e-3), tilt = random.uniform(11, 40) * kPi / 180;
      const double speed = random.uniform(8e-3, 15e-3);
      const Vec3d axis = std::cos(tilt) * up + std::sin(tilt) * up.unitOrthogonal();
      auto bone = rasterise<std::int16_t>(Shell{p - radius * up, radius, 6e-4}, o);
      CoupledOptions gains = kGains;
      gains.force = 8.5;
      HapticScene scene{
          bone, o.isovalue(), CoupledToolRenderer{burr.tool, gains},
          Cutting{PressureCut{}, CuttingForce({.edges = burr.edges, .speed = rpm(40'000), .force_scale = 1})}};
      Watch watch;
      const Vec3d way = n % 2 == 0 ? up : axis;
      for (double z = 5e-3; z > -7e-3; z -= speed * 1e-3) {
        watch.tick(scene, tool_at(p + z * way, axis), 1e-3, true);
        const CuttingReport& report = scene.cutting().law().report();
        const double pull = report.edges.force.norm();
        // By the law: 1/κ of the thrust where edges face the feed, more where they graze.
        CHECK(pull <= 4 / CuttingLaw{}.thrust_ratio * report.thrust + 1e-12);
        if (report.thrust > 0.05) ratio.add(pull / report.thrust);
      }
      CAPTURE(std::string(name));
      CHECK(watch.beyond() <= kRounding);
      beyond.add(watch.beyond());
    }
  MESSAGE("change beyond the motion's over the slope: ", beyond, "; pull over thrust ", ratio);
  CHECK(beyond.worst() > 0.5);
  CHECK(ratio.worst() > 1);
  CHECK(ratio.worst() < 2 / CuttingLaw{}.thrust_ratio);
}

// The loop's own ramp would drop the force at once.
TEST_CASE("wrench steps: a jump while pressed restarts no ramp of the servo loop where the scene bounds its wrench") {
  const RasterOptions o = image_of(1);
  auto bone = rasterise<std::int16_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const HapticScene bounded{bone, o.isovalue(), CoupledToolRenderer{kDrill, kGains}};
  CHECK(bounded.bounds_wrench());
  CoupledOptions unbounded = kGains;
  unbounded.release = kInf;
  CHECK_FALSE(HapticScene{bone, o.isovalue(), CoupledToolRenderer{kDrill, unbounded}}.bounds_wrench());
  // The device slides into bone, stays, and is then set 3 mm deeper at once.
  const Vec3d p = o.middle();
  ScriptedDevice device([p](int n) {
    const double deep = n < 200 ? -3e-4 + 4e-6 * n : n < 300 ? 5e-4 : 3.5e-3;
    return Moment{.X_DH = tool_at(p + (kRadius - deep) * Vec3d::UnitZ(), Vec3d::UnitZ())};
  });
  auto scene = bounded;
  ServoLoop<decltype(device), decltype(scene), NoPacing> loop(device, scene, Registration{}, {.ramp = 0.02});
  const RunReport report = loop.run_for(std::chrono::milliseconds(500));
  CHECK(report.ramps == 1);
  REQUIRE(device.wrote[299].force.norm() > 0.3);
  for (std::size_t i = 210; i < 500; ++i)
    CHECK((device.wrote[i].force - device.wrote[i - 1].force).norm() <= kRelease * 1e-3 * kRounding);
  CHECK(device.wrote[499].force.norm() > 2.5);

  const LineApproxRenderer line{ToolDiscretization{kDrill, LineCounts{}}};
  CHECK_FALSE(HapticScene{bone, o.isovalue(), line}.bounds_wrench());
  CHECK(HapticScene{bone, o.isovalue(), line, ReleaseLimit{}}.bounds_wrench());
}

}  // namespace
