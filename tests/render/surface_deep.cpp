// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/cases.hpp"
#include "support/figures.hpp"
#include "support/near.hpp"

#include <trephine/device/simulated_device.hpp>
#include <trephine/render/thesis/surface.hpp>

#include <doctest/doctest.h>

/// A group whose centre is in bone: thesis Eq. 18, 19 (hold) and the extension along the surface, told apart.
namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

const Burr kBall{.tip_radius = 0.0015, .shaft_length = 0};

template <class Scalar>
using Held = ThesisSurface<Scalar>;
template <class Scalar>
using Extended = SurfaceApproxRenderer<Scalar>;

Posed ball_at(const Vec3d& p) { return tool_at(p, Vec3d::UnitZ()); }

TEST_CASE_TEMPLATE("dragged along inside: the held force stays, the extension turns with the surface", Scalar, float,
                   double) {
  // Pressed into the top of a ball of bone and dragged down its side, the centre 2 voxels below the surface.
  const RasterOptions o{.size = {100, 40, 100}};
  const double big = 40 * kVoxel, inside = big - 2 * kVoxel;
  const auto grid = rasterise<std::uint8_t>(Ball{o.middle(), big}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Tool<Scalar> tool(kBall, {.sphere = 100});
  Held<Scalar> held(tool);
  Extended<Scalar> extended(tool);
  for (double r = big + 6 * kVoxel; r > inside; r -= 0.1 * kVoxel) {
    static_cast<void>(render_at(held, field, ball_at(o.middle() + r * Vec3d::UnitZ())));
    static_cast<void>(render_at(extended, field, ball_at(o.middle() + r * Vec3d::UnitZ())));
  }
  CHECK(angle_deg(held.groups()[0].force.template cast<double>(), Vec3d::UnitZ()) < 3.3);
  const Vec3d at_start = held.groups()[0].force.template cast<double>();
  CHECK(held.groups()[0].deep);
  double worst = 0, least = 1e9, most = 0;
  for (double a = 0; a < 1.2; a += 0.1 / 38) {
    const Vec3d out(std::sin(a), 0, std::cos(a));
    CHECK(render_at(held, field, ball_at(o.middle() + inside * out)).status == Status::kOk);
    const auto e = render_at(extended, field, ball_at(o.middle() + inside * out));
    CHECK(e.status == Status::kOk);
    worst = std::max(worst, angle_deg(e.wrench.force.template cast<double>(), out));
    least = std::min(least, static_cast<double>(e.wrench.force.norm()));
    most = std::max(most, static_cast<double>(e.wrench.force.norm()));
  }
  MESSAGE("extension dragged over 69 degrees: off the normal by at most ", worst, " deg, ", least, " to ", most, " N");
  CHECK((held.groups()[0].force.template cast<double>() - at_start).norm() == 0);
  CHECK(angle_deg(at_start, {std::sin(1.2), 0, std::cos(1.2)}) > 55);
  // Its direction is a proxy's, at a depth of 2 voxels.
  CHECK(worst < 1.2);
  CHECK(most < 1.05 * least);
}

TEST_CASE_TEMPLATE("started inside: held gives nothing, the extension pushes out; both say so", Scalar, float, double) {
  const Vec3d n = Vec3d(0.2, -0.4, 1).normalized();
  const RasterOptions o{.size = {64, 64, 64}};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Posed X = ball_at(o.middle() - 4 * kVoxel * n);
  Held<Scalar> held(Tool<Scalar>(kBall, SurfaceCounts::thesis()));
  for (int i = 0; i < 3; ++i) {
    const auto out = render_at(held, field, X);
    CHECK(out.status == Status::kStartedInside);
    CHECK(out.wrench == Wrench<Scalar>{});
    CHECK(out.contact.tip);
  }
  Extended<Scalar> extended(Tool<Scalar>(kBall, SurfaceCounts::thesis()));
  CHECK(render_at(extended, field, X).status == Status::kStartedInside);
  const auto out = render_at(extended, field, X);
  CHECK(out.status == Status::kOk);
  CHECK(angle_deg(out.wrench.force.template cast<double>(), n) < 0.47);
  CHECK(out.wrench.force.norm() > Scalar(0.5));
  // Both are right again once out and in again.
  for (double z = 8; z > -4; z -= 0.1) {
    static_cast<void>(render_at(held, field, ball_at(o.middle() + z * kVoxel * n)));
    static_cast<void>(render_at(extended, field, ball_at(o.middle() + z * kVoxel * n)));
  }
  CHECK(angle_deg(held.groups()[0].force.template cast<double>(), n) < 6);
  CHECK(angle_deg(extended.groups()[0].force.template cast<double>(), n) < 0.51);
}

template <class Scalar>
double jump_at_centre(int vertices, double& slope_after) {
  const double h = kVoxel, radius = kBall.tip_radius;
  const RasterOptions o{.size = {48, 48, 48}};
  Random random(81);
  double worst = 0;
  for (int i = 0; i < 20; ++i) {
    const Vec3d n = random.unit();
    const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
    const auto field = field_of<Scalar>(grid, o);
    Extended<Scalar> renderer(Tool<Scalar>(kBall, {.sphere = vertices}));
    const auto force = [&](double depth) {
      return Vec3d(
          render_at(renderer, field, ball_at(o.middle() + (radius - depth) * n)).wrench.force.template cast<double>());
    };
    for (double d = 0; d < radius - 0.05 * h; d += 0.1 * h) static_cast<void>(force(d));
    const Vec3d before = force(radius - 0.05 * h), after = force(radius + 0.05 * h);
    worst = std::max(worst, (after - before).norm() / after.norm());
    // Beyond: a straight line, edge force times (1 + depth / R).
    const double at_one = force(radius + 1 * h).norm(), at_four = force(radius + 4 * h).norm();
    slope_after = (at_four / at_one) / ((1 + 4 * h / radius) / (1 + h / radius));
    CHECK(slope_after == near(1, 0.024));
    // And out again the same way: the law does not depend on the way.
    for (double d = radius + 4 * h; d > radius; d -= 0.1 * h) static_cast<void>(force(d));
    CHECK((force(radius + 0.05 * h) - after).norm() < 0.0037 * after.norm());
    CHECK((force(radius - 0.05 * h) - before).norm() == 0);
  }
  return worst;
}

TEST_CASE_TEMPLATE("a jump starts deep contact anew and is said", Scalar, float, double) {
  const RasterOptions o{.size = {64, 64, 64}};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<Scalar>(grid, o);
  Held<Scalar> held(Tool<Scalar>(kBall, SurfaceCounts::thesis()));
  Extended<Scalar> extended(Tool<Scalar>(kBall, SurfaceCounts::thesis()));
  const Posed far = ball_at(o.middle() + Vec3d(0, 0, 0.02)), in = ball_at(o.middle() - Vec3d(0, 0, 0.001));
  for (double z = 6; z > -3; z -= 0.2) {
    static_cast<void>(render_at(held, field, ball_at(o.middle() + Vec3d(0, 0, z * kVoxel))));
    static_cast<void>(render_at(extended, field, ball_at(o.middle() + Vec3d(0, 0, z * kVoxel))));
  }
  CHECK(held.groups()[0].force.norm() > Scalar(0.5));
  CHECK(render_at(held, field, far).status == Status::kJump);
  CHECK(render_at(held, field, far).status == Status::kOk);
  // Nothing of the old force is left for the new place.
  const auto out = render_at(held, field, in);
  CHECK(out.status == Status::kJump);
  CHECK(out.wrench == Wrench<Scalar>{});
  // Nor from contact straight into bone elsewhere.
  for (double z = 6; z > -3; z -= 0.2)
    static_cast<void>(render_at(held, field, ball_at(o.middle() + Vec3d(0, 0, z * kVoxel))));
  CHECK(held.groups()[0].force.norm() > Scalar(0.5));
  CHECK(render_at(held, field, ball_at(o.middle() + Vec3d(0.008, 0, -0.001))).wrench == Wrench<Scalar>{});
  CHECK(render_at(extended, field, far).status == Status::kJump);
  CHECK(render_at(extended, field, in).status == Status::kJump);
  const auto again = render_at(extended, field, in);
  CHECK(again.status == Status::kOk);
  CHECK(angle_deg(again.wrench.force.template cast<double>(), Vec3d::UnitZ()) < 1e-6);
}

// How far the vertices' law with the centre on a plane is from its mean over all directions, which the extension begins
// with: the jump in closed form.
double spread_at_centre(int vertices) {
  const double radius = kBall.tip_radius;
  const Tool<double> tool(kBall, {.sphere = vertices});
  Random random(82);
  const auto force = [&](const Vec3d& n) { return plane_law(tool, 0, 0.999 * radius, n); };
  double mean = 0, worst = 0;
  constexpr int kTurns = 3000;
  for (int i = 0; i < kTurns; ++i) {
    const Vec3d n = random.unit();
    mean += force(n).dot(n) / kTurns;
  }
  for (int i = 0; i < kTurns; ++i) {
    const Vec3d n = random.unit();
    worst = std::max(worst, (force(n) - mean * n).norm() / mean);
  }
  return worst;
}

TEST_CASE_TEMPLATE("pressed through the centre: the extension begins where the vertices' law ends", Scalar, float,
                   double) {
  for (const int vertices : {26, 400}) {
    double slope = 0;
    const double jump = jump_at_centre<Scalar>(vertices, slope), spread = spread_at_centre(vertices);
    MESSAGE(vertices, " vertices: force jump where the centre enters, worst of 20 directions: ", jump,
            "; the law's own spread over directions: ", spread);
    // A tenth of a voxel of travel and the image's surface are 2 % of R each, its normal 1 %.
    CHECK(jump <= spread + 0.05);
  }
}

// A tool led along `way` to the origin of `shape` in steps [m]: how its force changes on the one with which its centre
// comes in [N]. `edge`: a plane's force there.
template <class Scalar, class Shape>
double step_where_centre_enters(const Shape& shape, const Vec3d& way, double step, double& edge) {
  const double radius = kBall.tip_radius;
  const RasterOptions o{.size = {48, 48, 48}};
  const auto grid = rasterise<std::uint8_t>([&](const Vec3d& p) { return shape(Vec3d(p - o.middle())); }, o);
  const auto field = field_of<Scalar>(grid, o);
  Extended<Scalar> renderer(Tool<Scalar>(kBall, {}));
  edge = renderer.foundation_stiffness() * mean_plane_force(renderer.tool(), 0, 1.0);
  Vec3d before = Vec3d::Zero();
  for (double off = 2 * radius; off > -radius; off -= step) {
    const Vec3d force =
        render_at(renderer, field, ball_at(o.middle() - off * way)).wrench.force.template cast<double>();
    if (renderer.groups()[0].deep) return (force - before).norm();
    before = force;
  }
  return 1e9;
}

TEST_CASE("a slice whose axis is in bone has its own force at the axis, and as much again a radius deeper") {
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.010};
  const ShapeField<double, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  SurfaceApproxRenderer<double> renderer(
      ToolDiscretization<SurfaceCounts, double>(burr, {.sphere = 150, .slices = 10, .per_slice = 16}));
  const auto force_at = [&](double deep) {  // of the shaft's axis, which lies along the plane
    static_cast<void>(lead(renderer, field, tool_at(Vec3d(0, 0, 1e-3), Vec3d::UnitX()),
                           tool_at(Vec3d(0, 0, -deep), Vec3d::UnitX()), 60));
    return renderer.slices()[5].force.z();
  };
  const double edge = force_at(-1e-6);
  CHECK(edge > 0.1);
  CHECK(force_at(1e-6) == near(edge, 0.05));
  CHECK(force_at(burr.shaft_radius / 2) == near(1.5 * edge, 0.05));
}

TEST_CASE_TEMPLATE("in a corner and over an edge too the extension begins where the vertices' law ends", Scalar, float,
                   double) {
  const auto corner = [](const Vec3d& p) { return p.minCoeff(); };
  const auto groove = [](const Vec3d& p) { return std::min(p.x(), p.z()); };
  const auto edge = [](const Vec3d& p) { return std::max(p.x(), p.z()); };
  const Vec3d diagonal = -Vec3d::Ones().normalized(), across = -Vec3d(1, 0, 1).normalized();
  const auto check = [](const char* name, const auto& shape, const Vec3d& way) {
    constexpr double kStep = 0.05 * kVoxel;
    double whole = 0;
    const double step = step_where_centre_enters<Scalar>(shape, way, kStep, whole);
    MESSAGE(std::string(name), ": where the centre enters the force steps by ", step / whole, " of a plane's there");
    // No steeper than three walls at once, each as a plane is there: 2 / R; and the image's rounding.
    CHECK(step < (6 * kStep / kBall.tip_radius + 0.03) * whole);
  };
  check("corner", corner, diagonal);
  check("groove", groove, across);
  check("edge", edge, across);
}

// Three walls at once push a device in nobody's hand, pressed so far in that the ball's centre is in bone and as stiff
// as the device's damping bears along the diagonal, Σ (n · d)² = 1 wall's: it comes to rest.
TEST_CASE("pressed deep into a corner a device comes to rest") {
  const RasterOptions o{.size = {48, 48, 48}};
  const auto grid = rasterise<std::uint8_t>([&](const Vec3d& p) { return Vec3d(p - o.middle()).minCoeff(); }, o);
  const auto field = field_of<float>(grid, o);
  const Vec3d into = -Vec3d::Ones().normalized();
  constexpr double kTick = 1e-3, kDamping = 2;  // bears 2 b / T
  int deep = 0;
  for (const double stiffness : {300.0, 450.0, 600.0}) {
    for (const double pressed : {2.0, 3.0, 4.0}) {
      CAPTURE(stiffness);
      CAPTURE(pressed);
      SurfaceOptions options;
      options.stiffness = stiffness;
      SurfaceApproxRenderer<float> renderer(Tool<float>(kBall, {}), options);
      SimulatedDeviceOptions device_options;
      device_options.linear = {.inertia = 0.06, .damping = kDamping};
      device_options.hand_linear = {};
      device_options.output_dof = 3;
      device_options.substeps = 1;
      device_options.X_DH = ball_at(o.middle() - 1.7 * kBall.tip_radius * into);
      SimulatedDevice device(device_options, StillHand{});
      DeviceState state;
      double low = 1, high = -1;
      for (int i = 0; i < 4000; ++i) {
        REQUIRE(device.read(state) == DeviceStatus::kOk);
        Wrenchd w = in_double(render_at(renderer, field, state.X_DH).wrench);
        w.force += pressed * into;
        w.torque.setZero();
        static_cast<void>(device.write(w));
        device.advance(kTick);
        if (i < 3000) continue;
        low = std::min(low, state.X_DH.translation().x());
        high = std::max(high, state.X_DH.translation().x());
      }
      deep += renderer.groups()[0].deep ? 1 : 0;
      CHECK(high - low < 1.3e-6);
    }
  }
  CHECK(deep >= 4);
}

TEST_CASE_TEMPLATE("slid out of a corner, deep, the force is a plane's again", Scalar, float, double) {
  const double radius = kBall.tip_radius;
  const RasterOptions o{.size = {64, 64, 64}};
  const Vec3d at = o.middle() - Vec3d::Constant(3e-3);
  const auto grid = rasterise<std::uint8_t>([&](const Vec3d& p) { return (p - at).minCoeff(); }, o);
  const auto field = field_of<Scalar>(grid, o);
  Extended<Scalar> renderer(Tool<Scalar>(kBall, {}));
  const double edge = renderer.foundation_stiffness() * mean_plane_force(renderer.tool(), 0, 1.0);
  const Vec3d in = at - 0.1 * radius * Vec3d::Ones(), out = Vec3d(in.x(), at.y() + 3 * radius, at.z() + 3 * radius);
  static_cast<void>(lead(renderer, field, ball_at(at + 2 * radius * Vec3d::Ones()), ball_at(in), 200));
  static_cast<void>(lead(renderer, field, ball_at(in), ball_at(out), 200));
  CHECK(renderer.groups()[0].deep);
  const Vec3d force = renderer.groups()[0].force.template cast<double>();
  CHECK((force - 1.1 * edge * Vec3d::UnitX()).norm() < 0.01 * edge);
}

/// Pressed 2.8 mm deep into a plane and slid to and fro there, in single and in double precision.
struct DeepSlide {
  double apart = 0, step = 0;  ///< of the two forces, and largest step of one [N]
};
DeepSlide slide_deep(const RasterOptions& o, const Vec3d& n, const Vec3d& at) {
  constexpr double kDeep = 2.8e-3;
  constexpr int kSteps = 3000;
  const auto grid = rasterise<std::int16_t>(HalfSpace{at, n}, o);
  const DensityField<std::int16_t, float, SplineGradient> single(grid, o.isovalue());
  const DensityField<std::int16_t, double, SplineGradient> fine(grid, o.isovalue());
  SurfaceApproxRenderer<float> rounded(Tool<float>(kBall, SurfaceCounts{}));
  SurfaceApproxRenderer<double> exact(Tool<double>(kBall, SurfaceCounts{}));
  const Vec3d along = n.unitOrthogonal();
  DeepSlide out;
  Vec3d last = Vec3d::Zero();
  for (int i = 0; i <= kSteps; ++i) {
    const double s = static_cast<double>(i) / kSteps;
    const Posed X =
        ball_at(at + (kBall.tip_radius - std::min(1.0, 3 * s) * kDeep) * n + 3e-4 * std::sin(6 * s) * along);
    const Vec3d a = render_at(rounded, single, X).wrench.force.template cast<double>();
    const Vec3d b = render_at(exact, fine, X).wrench.force;
    out.apart = std::max(out.apart, (a - b).norm());
    if (s > 0.5) out.step = std::max(out.step, (b - last).norm());
    last = b;
  }
  return out;
}

TEST_CASE("deep contact does not amplify rounding: single and double precision agree" * doctest::test_suite("long")) {
  constexpr unsigned kSeed = 41;
  Random random(kSeed);
  Figures apart, step, apart_on_noise, step_on_noise;
  for (const double blur : {0.5, 0.7, 1.0})
    for (int c = 0; c < cases(12); ++c) {
      RasterOptions o{.size = {48, 48, 48}, .blur = blur, .contrast = 1000};
      const Vec3d n = random.unit(), at = o.middle() + kVoxel * random.arrow() - kBall.tip_radius * n;
      const DeepSlide clean = slide_deep(o, n, at);
      apart.add(clean.apart);
      step.add(clean.step);
      o.noise = 0.05 * o.contrast;
      const DeepSlide noisy = slide_deep(o, n, at);
      apart_on_noise.add(noisy.apart);
      step_on_noise.add(noisy.step);
    }
  CAPTURE(kSeed);
  MESSAGE("apart [N] ", apart, "; steps [N] ", step, "; on noise: apart ", apart_on_noise, ", steps ", step_on_noise);
  // A proxy rests within some thousandths of a voxel, at a depth of 4 voxels.
  CHECK(apart.worst() < 0.0071);
  // A step is 1.2 µm at most: the force turns by it over the depth.
  CHECK(step.worst() < 0.006);
  // Noise has bumps between which a proxy snaps, not at the same step in both precisions. Most slides meet none.
  if (!kSanitized) CHECK(apart_on_noise.median() < 0.0074);
  CHECK(apart_on_noise.worst() < 0.088);
  CHECK(step_on_noise.worst() < 0.0093);
}

}  // namespace
